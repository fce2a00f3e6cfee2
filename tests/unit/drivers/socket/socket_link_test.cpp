// What the links over a socket share, over a Unix socket pair: a medium that the test can fill, and
// that it can take away.
#include "drivers/socket/socket_link.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "loop/clock.hpp"
#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kPacketBytes = 200;

class PairLink final : public SocketLink {
 public:
  /// @param is_apart  frames leave by a socket of their own
  PairLink(boost::asio::io_context& io, int socket, bool is_apart, PacerConfig pacer = {})
      : SocketLink(io, frame::ProfileId::kKilobot, kPacketBytes, pacer) {
    use_receive_socket(socket);
    if (is_apart) use_send_socket(::dup(socket));
    set_limits(500, 2000);
  }
  std::string type() const override { return "pair"; }
  std::string device() const override { return "here"; }

  using SocketLink::set_limits;
  using SocketLink::set_own_hardware;
  using SocketLink::set_state;

  std::string remark() const { return mtu_remark(); }

  bool is_medium_up = true;
  bool is_echo = false;  // all that comes
  int refreshes = 0;

 protected:
  std::optional<std::span<const std::uint8_t>> air_frame(const Datagram& datagram) override {
    if (is_echo) return std::nullopt;
    return datagram.bytes;
  }
  std::uint64_t hardware_of(const Datagram&) const override { return 0xABC; }
  std::size_t medium_header_bytes() const override { return 3; }
  void refresh() override {
    ++refreshes;
    set_state(is_medium_up, is_medium_up ? "up" : "away");
  }
  std::uint64_t kernel_drops() const override { return 77; }
};

class PairUser final : public TestLinkUser {
 public:
  using TestLinkUser::TestLinkUser;
  void on_link_state() override { ++states; }
  int states = 0;
};

class HeardFrames final : public FrameTap {
 public:
  void before_received() override { ++begun; }
  void received(std::span<const std::uint8_t> datagram, std::size_t header_bytes) override {
    headers.push_back(header_bytes);
    received_bytes.emplace_back(datagram.begin(), datagram.end());
  }
  void sent(std::span<const std::uint8_t> frame) override {
    sent_bytes.emplace_back(frame.begin(), frame.end());
  }

  int begun = 0;
  std::vector<std::size_t> headers;
  std::vector<Bytes> received_bytes, sent_bytes;
};

class SocketLinkTest : public testing::TestWithParam<bool> {
 protected:
  SocketLinkTest() {
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends_), 0);
    const int smallest = 1;  // that the kernel allows: some kilobytes
    EXPECT_EQ(::setsockopt(ends_[0], SOL_SOCKET, SO_SNDBUF, &smallest, sizeof smallest), 0);
  }
  ~SocketLinkTest() override { ::close(ends_[1]); }

  PairLink& make(const PacerConfig& pacer = {}) {
    return link_.emplace(io_, ends_[0], GetParam(), pacer);
  }
  void send_packets(std::uint32_t from, std::uint32_t to) {
    for (std::uint32_t i = from; i < to; ++i) {
      user_.waiting.push_back(numbered_packet(i, kPacketBytes));
    }
    link_->wake();
  }
  /// Reads all that has come to the other end, and returns its packets.
  std::vector<Bytes> heard() {
    Bytes bytes(2000);
    for (;;) {
      const ssize_t got = ::recv(ends_[1], bytes.data(), bytes.size(), 0);
      if (got < 0) break;
      frames_.emplace_back(bytes.begin(), bytes.begin() + got);
      receiver_.receive(frames_.back(), {}, hearer_, counters_);
    }
    return hearer_.received;
  }
  std::uint64_t count(const std::string& name) { return counter(*link_, name); }

  boost::asio::io_context io_;
  int ends_[2];
  PairUser user_{1};
  std::optional<PairLink> link_;
  TestLinkUser hearer_{2};
  FrameReceiver receiver_{frame::ProfileId::kKilobot};
  LinkCounters counters_;
  std::vector<Bytes> frames_;
};

TEST_P(SocketLinkTest, KeepsFramesThatTheKernelHasNoRoomForUntilItHas) {
  make().start(user_);
  send_packets(0, 200);  // a hundred frames; the socket holds a few
  ASSERT_TRUE(run_until(io_, [&] { return count("send_retries") > 0; }));
  EXPECT_LT(count("packets_sent"), 200u);
  ASSERT_TRUE(run_until(io_, [&] { return heard().size() == 200; })) << heard().size();
  for (std::uint32_t i = 0; i < 200; ++i) EXPECT_EQ(packet_number(hearer_.received[i]), i);
  EXPECT_EQ(count("packets_sent"), 200u);
  EXPECT_EQ(count("frames_sent"), frames_.size());
  EXPECT_EQ(count("send_errors"), 0u);
  EXPECT_EQ(count("kernel_drops"), 77u);
}

TEST_P(SocketLinkTest, GivesUpAFrameThatHasBecomeTooLongAndSendsTheNext) {
  make().start(user_);
  link_->set_limits(60'000, 2000);  // more than the socket takes
  const int before = link_->refreshes;
  send_packets(0, 100);
  ASSERT_TRUE(run_until(io_, [&] { return count("send_errors") > 0; }));
  EXPECT_EQ(count("send_errors"), 1u);
  EXPECT_EQ(count("packets_over_mtu"), 100u) << "all of the frame";
  EXPECT_EQ(count("packets_sent"), 0u);
  EXPECT_EQ(link_->refreshes, before + 1) << "the MTU has changed";
  link_->set_limits(500, 2000);
  send_packets(100, 101);
  ASSERT_TRUE(run_until(io_, [&] { return heard().size() == 1; }));
  EXPECT_EQ(packet_number(hearer_.received[0]), 100u);
}

TEST_P(SocketLinkTest, CountsFramesThatTheKernelRefuses) {
  make().start(user_);
  ::shutdown(ends_[1], SHUT_RDWR);
  send_packets(0, 4);
  ASSERT_TRUE(run_until(io_, [&] { return user_.waiting.empty(); }));
  EXPECT_EQ(count("send_errors"), 2u) << "two frames of two packets";
  EXPECT_EQ(count("packets_over_mtu"), 0u);
  EXPECT_EQ(count("frames_sent"), 0u);
}

TEST_P(SocketLinkTest, SendsNothingWhileItIsDownAndWhatWaitsWhenItComesUp) {
  make().is_medium_up = false;
  link_->start(user_);
  EXPECT_FALSE(link_->is_up());
  EXPECT_EQ(link_->state(), "away");
  send_packets(0, 1);
  run_for(io_, 20ms);
  EXPECT_TRUE(heard().empty());
  EXPECT_EQ(user_.waiting.size(), 1u);
  const int states = user_.states;
  link_->set_state(true, "up");
  EXPECT_EQ(user_.states, states + 1);
  ASSERT_TRUE(run_until(io_, [&] { return heard().size() == 1; }));
  link_->set_state(false, "away");
  link_->set_state(false, "away");
  EXPECT_EQ(user_.states, states + 2);
  EXPECT_EQ(count("link_down_events"), 1u);
}

TEST_P(SocketLinkTest, IsLookedAtAgainWhileItIsDown) {
  make().is_medium_up = false;
  link_->start(user_);
  link_->is_medium_up = true;  // and no word of it
  EXPECT_TRUE(run_until(io_, [&] { return link_->is_up(); }));
}

TEST_P(SocketLinkTest, HandsUpWhatComesAndShowsItToACapture) {
  make().start(user_);
  HeardFrames tap;
  link_->set_tap(&tap);
  FrameBuilder builder(frame::ProfileId::kKilobot, kPacketBytes);
  hearer_.waiting.push_back(numbered_packet(5, 20));
  Bytes bytes(builder.buffer_bytes(500));
  bytes.resize(builder.build(hearer_, bytes, 500, counters_).size_bytes);
  const auto send = [&](const Bytes& datagram) {
    ASSERT_EQ(::send(ends_[1], datagram.data(), datagram.size(), 0),
              static_cast<ssize_t>(datagram.size()));
  };
  send(bytes);
  ASSERT_TRUE(run_until(io_, [&] { return user_.received.size() == 1; }));
  EXPECT_EQ(packet_number(user_.received[0]), 5u);
  EXPECT_EQ(user_.frames.at(0).hardware, 0xABCu);
  EXPECT_EQ(user_.frames.at(0).transmitter, 2);
  EXPECT_FALSE(user_.frames.at(0).has_our_hardware);
  EXPECT_EQ(count("frames_received"), 1u);
  link_->set_own_hardware(0xABC);
  send(bytes);
  ASSERT_TRUE(run_until(io_, [&] { return user_.frames.size() == 2; }));
  EXPECT_TRUE(user_.frames.at(1).has_our_hardware);
  link_->is_echo = true;
  send(bytes);
  ASSERT_TRUE(run_until(io_, [&] { return count("own_echoes") == 1; }));
  EXPECT_EQ(user_.received.size(), 2u);
  send({1, 2});  // shorter than a header
  ASSERT_TRUE(run_until(io_, [&] { return tap.begun == 4; }));
  EXPECT_EQ(tap.headers, (std::vector<std::size_t>{3, 3, 3, 2}));
  EXPECT_EQ(tap.received_bytes, (std::vector<Bytes>{bytes, bytes, bytes, {1, 2}}));
  send_packets(0, 1);
  ASSERT_TRUE(run_until(io_, [&] { return heard().size() == 1; }));
  EXPECT_EQ(tap.sent_bytes, std::vector<Bytes>{frames_.back()});
  link_->set_tap(nullptr);
  send(bytes);
  ASSERT_TRUE(run_until(io_, [&] { return count("own_echoes") == 3; }));
  EXPECT_EQ(tap.begun, 4);
}

TEST_P(SocketLinkTest, SendsABeaconWhenItIsSilentAndShowsItToACapture) {
  HeardFrames tap;
  make().set_tap(&tap);
  link_->set_beacon(20ms);
  user_.last = {{3, 70}};
  link_->start(user_);
  ASSERT_TRUE(run_until(io_, [&] { return count("beacons_sent") == 1; }));
  EXPECT_TRUE(heard().empty());
  EXPECT_EQ(hearer_.last_heard, user_.last);
  EXPECT_EQ(count("frames_sent"), 1u);
  EXPECT_EQ(tap.sent_bytes, frames_);
}

TEST_P(SocketLinkTest, SendsNoBeaconWhileItIsDownOrSomethingWaits) {
  make().is_medium_up = false;
  link_->set_beacon(20ms);
  link_->start(user_);
  run_for(io_, 60ms);
  EXPECT_EQ(count("beacons_sent"), 0u);
}

TEST_P(SocketLinkTest, BeaconsKeepToTheRateAndNoMessageWaitsForThem) {
  PacerConfig slow;
  slow.rate_limit_hz = 2;
  make(slow).set_beacon(20ms);
  link_->start(user_);
  for (int i = 0; i < 60; ++i) {
    run_for(io_, 1s);
    heard();
  }
  EXPECT_GE(count("beacons_sent"), 119u);
  EXPECT_LE(count("beacons_sent"), 121u);
  const auto before = loop::now();
  send_packets(0, 1);
  ASSERT_TRUE(run_until(io_, [&] { return heard().size() == 1; }));
  EXPECT_LE(loop::now() - before, 500ms);
}

TEST_P(SocketLinkTest, IsWokenAtTheTimeThatWasAskedForAndNotBefore) {
  make().start(user_);
  run_for(io_, 5ms);
  user_.waiting.push_back(numbered_packet(1, 20));
  const auto at = loop::now() + 50ms;
  link_->wake_at(at + 1h);
  link_->wake_at(at);
  link_->wake_at(at + 1h);
  ASSERT_TRUE(run_until(io_, [&] { return heard().size() == 1; }));
  EXPECT_GE(loop::now(), at);
}

TEST_P(SocketLinkTest, ANewPaceCountsAtOnce) {
  PacerConfig slow;
  slow.rate_limit_hz = 0.001;
  make(slow).start(user_);
  send_packets(0, 4);
  ASSERT_TRUE(run_until(io_, [&] { return heard().size() == 2; })) << "one frame";
  run_for(io_, 20ms);
  EXPECT_EQ(heard().size(), 2u);
  link_->set_pacing({});
  ASSERT_TRUE(run_until(io_, [&] { return heard().size() == 4; }));
}

TEST_P(SocketLinkTest, SaysWhenTheLongestPacketFitsIntoNoFrame) {
  make().start(user_);
  const std::size_t around = frame::kHeaderBytes + frame::kPoseBytes + frame::kLengthPrefixBytes;
  link_->set_limits(kPacketBytes + around, 2000);
  EXPECT_EQ(link_->packet_limit_bytes(), kPacketBytes);
  EXPECT_EQ(link_->remark(), "");
  link_->set_limits(kPacketBytes + around - 1, 2000);
  EXPECT_EQ(link_->remark(),
            ", too small: packets of more than 199 bytes are dropped (up to 200 occur)");
}

INSTANTIATE_TEST_SUITE_P(All, SocketLinkTest, testing::Bool(), [](const auto& each) {
  return each.param ? "WithASocketToSend" : "WithOneSocket";
});

}  // namespace
}  // namespace swarmtalk::drivers
