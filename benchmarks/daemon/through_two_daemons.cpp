// Work for callgrind: MESSAGES messages of 100 bytes from a program through two daemons to another
// program. The parts of both are in this process, without radio: what the one's link pulls is
// handed to the other's. The difference between two run lengths is the cost of messages alone.
//   daemon_through_two MESSAGES     prints how many were heard
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "daemon/operator/status_report.hpp"
#include "daemon/session/clients.hpp"
#include "daemon/station/node_station.hpp"
#include "ipc/framing.hpp"
#include "ipc/message_frames.hpp"
#include "loop/loop.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace {

using namespace swarmtalk;
using namespace swarmtalk::daemon;

constexpr int kAtOnce = 4;  // of a queue; what a program writes between two turns of the daemon
constexpr std::size_t kPayloadBytes = 100;
constexpr std::size_t kBufferBytes = 65536;

[[noreturn]] void fail(const char* what) {
  std::fprintf(stderr, "daemon_through_two: %s\n", what);
  std::exit(1);
}

/// A daemon's parts, between a link played by hand and a program's end of a socket.
class Half {
 public:
  explicit Half(std::uint16_t node) : identity_(node) {
    auto link = std::make_unique<FakeLink>();
    link_ = link.get();
    station_ = std::make_unique<NodeStation<core::Wifi>>(
        "wifi", ProfileName{frame::ProfileId::kWifi, "wifi"}, std::move(link), identity_, poses_,
        hub_);
    station_->start();
    hub_.add(*station_);
    status_.set_clients(clients_);
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends) != 0) fail("no socket");
    clients_.add(ends[0]);
    program_ = ends[1];
    ipc::Envelope hello;
    hello.mutable_hello()->set_major(ipc::kProtocolMajor);
    hello.mutable_hello()->set_name("benchmark");
    ask(hello);
  }
  ~Half() { ::close(program_); }
  Half(const Half&) = delete;
  Half& operator=(const Half&) = delete;

  void write(const std::string& bytes) {
    if (::send(program_, bytes.data(), bytes.size(), 0) < 0) fail("the daemon does not read");
  }
  /// One turn of the daemon's loop, and more while there is work.
  void turn() { drive_.poll(); }
  /// What the daemon has written.
  std::size_t drain() {
    std::size_t sum = 0;
    ssize_t count = 0;
    while ((count = ::recv(program_, buffer_.data(), buffer_.size(), 0)) > 0) {
      sum += static_cast<std::size_t>(count);
    }
    return sum;
  }
  ipc::Envelope ask(const ipc::Envelope& question) {
    std::string bytes;
    ipc::append_frame(question, bytes);
    write(bytes);
    turn();
    ipc::FrameReader reader;
    const auto room = reader.prepare(kBufferBytes);
    const ssize_t count = ::recv(program_, room.data(), room.size(), 0);
    if (count <= 0) fail("no answer");
    reader.commit(static_cast<std::size_t>(count));
    ipc::Envelope answer;
    if (reader.next(answer) != ipc::ReadResult::kEnvelope) fail("no answer");
    return answer;
  }
  drivers::LinkUser& air() { return link_->user(); }
  std::uint32_t epoch() const { return identity_.epoch(); }
  std::uint64_t delivered() const { return counters_.deliveries_sent; }

 private:
  NodeIdentity identity_;
  ChannelTable names_{{{"hello", 1}}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  PoseKeeper poses_{NodeConfig{}};
  boost::asio::io_context io_;
  Hub hub_{names_, limits_, counters_, identity_};
  FakeLink* link_ = nullptr;
  std::unique_ptr<NodeStation<core::Wifi>> station_;
  StatusReport status_{hub_, poses_, identity_, counters_, "none"};
  Clients clients_{io_, hub_, poses_, limits_, counters_, status_};
  loop::Loop::Drive drive_{loop::Loop::of(io_)};
  int program_ = -1;
  std::array<char, kBufferBytes> buffer_;
};

std::uint32_t advertise(Half& half) {
  ipc::Envelope question;
  question.set_request_id(1);
  question.mutable_advertise()->mutable_channel()->set_name("hello");
  question.mutable_advertise()->set_queue(kAtOnce);
  return half.ask(question).advertised().publisher_id();
}

void subscribe(Half& half) {
  ipc::Envelope question;
  question.set_request_id(1);
  question.mutable_subscribe()->mutable_channel()->set_name("hello");
  half.ask(question);
}

void run(std::uint64_t messages, Half& from, Half& to) {
  subscribe(to);
  ipc::PublishFrame message;
  message.publisher_id = advertise(from);
  const std::string payload(kPayloadBytes, 'x');
  message.payload = payload;
  std::array<std::uint8_t, 1400> packet;
  drivers::FrameReception frame;
  frame.transmitter = 5;
  frame.transmitter_epoch = from.epoch();
  frame.received_at = std::chrono::steady_clock::now();
  std::string bytes;
  while (message.publish_number < messages) {
    bytes.clear();
    for (int i = 0; i < kAtOnce; ++i) {
      ++message.publish_number;
      ipc::append_frame(message, bytes);
    }
    from.write(bytes);
    from.turn();
    while (const std::size_t size = from.air().pull_packet(packet)) {
      to.air().on_packet({packet.data(), size}, frame);
      to.air().on_frame(frame);
    }
    to.turn();
    to.drain();
    from.turn();
    from.drain();
  }
}

}  // namespace

int main(int count, char** values) {
  if (count != 2) fail("usage: daemon_through_two MESSAGES, a multiple of 4");
  const std::uint64_t messages = std::strtoull(values[1], nullptr, 10);
  auto from = std::make_unique<Half>(5);
  auto to = std::make_unique<Half>(6);
  run(messages, *from, *to);
  std::printf("%llu\n", static_cast<unsigned long long>(to->delivered()));
  return to->delivered() == messages ? 0 : 1;
}
