// A daemon without link or socket path: hub, a fake station, sessions over real Unix socket pairs.
// Nothing happens until step(): the event loop runs when the test says so.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <memory>
#include <string>
#include <vector>

#include "daemon/common/monotonic_ns.hpp"
#include "daemon/operator/status_report.hpp"
#include "daemon/session/clients.hpp"
#include "ipc/framing.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {

/// One end of a socket pair, speaking the local protocol.
class TestPeer {
 public:
  explicit TestPeer(int descriptor) : descriptor_(descriptor) {}
  TestPeer(const TestPeer&) = delete;
  ~TestPeer() { hang_up(); }

  void hang_up() {
    if (descriptor_ >= 0) ::close(descriptor_);
    descriptor_ = -1;
  }
  void end_requests() { ::shutdown(descriptor_, SHUT_WR); }
  void send_bytes(const std::string& bytes) {
    ASSERT_EQ(::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT),
              static_cast<ssize_t>(bytes.size()));
  }
  void send(const ipc::Envelope& envelope) {
    std::string bytes;
    ASSERT_TRUE(ipc::append_frame(envelope, bytes));
    send_bytes(bytes);
  }
  /// @return false: the socket has no room for it
  bool try_send(const ipc::Envelope& envelope) {
    std::string bytes;
    EXPECT_TRUE(ipc::append_frame(envelope, bytes));
    const ssize_t sent =
        ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    EXPECT_TRUE(sent < 0 || sent == static_cast<ssize_t>(bytes.size()));
    return sent > 0;
  }
  void hello(std::uint32_t major = ipc::kProtocolMajor) {
    ipc::Envelope envelope;
    envelope.mutable_hello()->set_major(major);
    envelope.mutable_hello()->set_name("test");
    send(envelope);
  }
  void subscribe(std::uint32_t request_id, const std::string& channel,
                 std::optional<std::uint32_t> keep_last = std::nullopt) {
    ipc::Envelope envelope;
    envelope.set_request_id(request_id);
    envelope.mutable_subscribe()->mutable_channel()->set_name(channel);
    if (keep_last) envelope.mutable_subscribe()->set_keep_last(*keep_last);
    send(envelope);
  }
  void advertise(std::uint32_t request_id, const std::string& channel, std::uint32_t queue = 0) {
    ipc::Envelope envelope;
    envelope.set_request_id(request_id);
    envelope.mutable_advertise()->set_queue(queue);
    envelope.mutable_advertise()->mutable_channel()->set_name(channel);
    send(envelope);
  }
  void publish(std::uint32_t publisher, std::uint64_t number, const std::string& payload) {
    ipc::Envelope envelope;
    envelope.mutable_publish()->set_publisher_id(publisher);
    envelope.mutable_publish()->set_publish_number(number);
    envelope.mutable_publish()->set_payload(payload);
    send(envelope);
  }

  /// All frames that have arrived. Sets is_closed when the daemon hung up.
  std::vector<ipc::Envelope> receive() {
    std::vector<ipc::Envelope> envelopes;
    for (;;) {
      const auto room = reader_.prepare(65536);
      const ssize_t got = recv(descriptor_, room.data(), room.size(), MSG_DONTWAIT);
      if (got == 0) is_closed = true;
      if (got < 0 && errno == ECONNRESET) is_closed = true;
      if (got <= 0) break;
      reader_.commit(static_cast<std::size_t>(got));
    }
    ipc::Envelope envelope;
    while (reader_.next(envelope) == ipc::ReadResult::kEnvelope) envelopes.push_back(envelope);
    return envelopes;
  }

  /// Whether the daemon has let the connection go, and not only said its last.
  bool is_gone() const { return ::send(descriptor_, "x", 1, MSG_NOSIGNAL | MSG_DONTWAIT) < 0; }

  bool is_closed = false;

 private:
  int descriptor_;
  ipc::FrameReader reader_;
};

class SessionTest : public testing::Test {
 protected:
  SessionTest() {
    hub_.add(station_);
    status_.set_clients(clients_);
  }
  ~SessionTest() override { clients_.close_all("test ends"); }

  std::unique_ptr<TestPeer> connect() {
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    fcntl(ends[0], F_SETFL, O_NONBLOCK);
    clients_.add(ends[0]);
    return std::make_unique<TestPeer>(ends[1]);
  }
  std::unique_ptr<TestPeer> greeted() {
    auto peer = connect();
    peer->hello();
    step();
    EXPECT_EQ(peer->receive().size(), 1u);
    return peer;
  }
  /// Subscribes and returns the subscription's id.
  std::uint32_t subscribed(TestPeer& peer, const std::string& channel,
                           std::optional<std::uint32_t> keep_last = std::nullopt) {
    peer.subscribe(1, channel, keep_last);
    step();
    const auto replies = peer.receive();
    EXPECT_EQ(replies.size(), 1u);
    return replies.at(0).subscribed().subscription_id();
  }
  std::uint32_t advertised(TestPeer& peer, const std::string& channel, std::uint32_t queue = 0) {
    peer.advertise(1, channel, queue);
    step();
    const auto replies = peer.receive();
    EXPECT_EQ(replies.size(), 1u);
    return replies.at(0).advertised().publisher_id();
  }
  void step() {
    io_.restart();
    io_.poll();
  }
  void receive_on_air(const std::string& channel, const std::string& payload,
                      std::uint32_t number = 1, float distance_m = 2.0f,
                      std::uint64_t received_at_ns = monotonic_ns()) {
    MessageHead head;
    head.channel = names_.find(channel).number;
    head.sender = 9;
    head.number = number;
    head.distance_m = distance_m;
    head.received_at_ns = received_at_ns;
    head.bearing_rad = 0.5f;
    station_.receive(head, payload);
  }

  boost::asio::io_context io_;
  ChannelTable names_{{{"hello", 1}}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  PoseKeeper poses_{NodeConfig{}};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation station_{hub_};
  StatusReport status_{hub_, poses_, identity_, counters_, "f.toml"};
  Clients clients_{io_, hub_, poses_, limits_, counters_, status_};
};

}  // namespace swarmtalk::daemon
