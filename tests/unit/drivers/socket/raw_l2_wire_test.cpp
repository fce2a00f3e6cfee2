// What a RawL2Link puts on the wire, and what it makes of foreign and broken frames from there.
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <sys/socket.h>

#include <filesystem>

#include "drivers/socket/ether_filter.hpp"
#include "drivers/socket/raw_l2.hpp"
#include "tests/unit/drivers/test_network.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

const Bytes kNeighbourMac = {0x02, 0, 0, 0, 0, 0x77};

/// A good frame with one packet of 10 bytes.
Bytes good_frame(frame::ProfileId profile = frame::ProfileId::kWifi) {
  Bytes bytes(100);
  frame::FrameHeader header;
  header.profile = profile;
  header.node = 5;
  frame::FrameWriter writer(bytes, header, bytes.size());
  writer.append(numbered_packet(1, 10));
  bytes.resize(writer.finish().size());
  return bytes;
}

class RawL2Wire : public ::testing::Test {
 protected:
  void SetUp() override {
    SWARMTALK_SKIP_WITHOUT_ROOT();
    network_.emplace();
    config_.interface = "air0";
    link_ = network_->link<RawL2Link>('a', io_, config_);
    link_->start(user_);
    probe_.emplace(*network_, 'b');
    ASSERT_TRUE(run_until(io_, [&] { return link_->is_up(); })) << link_->state();
  }

  void expect_counted(const std::string& name, const Bytes& bytes) {
    SCOPED_TRACE(name);
    probe_->inject(bytes, kNeighbourMac);
    EXPECT_TRUE(run_until(io_, [&] { return counter(*link_, name) == 1; }));
    EXPECT_EQ(counter(*link_, "frames_received"), 0U);
    EXPECT_TRUE(user_.received.empty());
  }

  std::optional<TestNetwork> network_;
  std::optional<WireProbe> probe_;
  boost::asio::io_context io_;
  RawL2Config config_;
  TestLinkUser user_{1};
  std::unique_ptr<RawL2Link> link_;
};

TEST_F(RawL2Wire, SendsBroadcastFramesOfItsEthertypeAndNothingElse) {
  for (std::uint32_t i = 0; i < 200; ++i) {
    user_.waiting.push_back(numbered_packet(i, 4 + 7 * i));
    link_->wake();
  }
  const Bytes mac = WireProbe(*network_, 'a').mac();
  ASSERT_TRUE(run_until(io_, [&] { return counter(*link_, "packets_sent") == 200; }));
  run_for(io_, 20ms);
  const std::vector<Bytes> frames = probe_->heard();
  EXPECT_EQ(frames.size(), counter(*link_, "frames_sent"));
  for (const Bytes& bytes : frames) {
    ASSERT_GE(bytes.size(), 14U);
    ASSERT_LE(bytes.size(), 1514U);
    EXPECT_EQ(Bytes(bytes.begin(), bytes.begin() + 6), Bytes(6, 0xFF));
    EXPECT_EQ(Bytes(bytes.begin() + 6, bytes.begin() + 12), mac);
    EXPECT_EQ(Bytes(bytes.begin() + 12, bytes.begin() + 14), (Bytes{0x88, 0xB5}));
    frame::Frame frame;
    EXPECT_EQ(frame::parse(std::span(bytes).subspan(14), frame), frame::ParseResult::kOk);
  }
}

TEST_F(RawL2Wire, SaysNothingUnasked) {
  run_for(io_, 100ms);
  EXPECT_TRUE(probe_->heard().empty());
}

TEST_F(RawL2Wire, ReceivesAFrameWithEthernetPadding) {
  Bytes bytes = good_frame();
  bytes.resize(46);
  probe_->inject(bytes, kNeighbourMac);
  ASSERT_TRUE(run_until(io_, [&] { return !user_.received.empty(); }));
  EXPECT_EQ(user_.received[0], numbered_packet(1, 10));
}

TEST_F(RawL2Wire, CountsGarbage) {
  expect_counted("frames_not_ours", Bytes(200, 0xA5));
}

TEST_F(RawL2Wire, CountsAFrameWithoutContent) {
  expect_counted("frames_not_ours", {});
}

TEST_F(RawL2Wire, CountsATruncatedFrame) {
  Bytes bytes = good_frame();
  bytes.pop_back();
  expect_counted("frames_truncated", bytes);
}

TEST_F(RawL2Wire, CountsAnotherVersion) {
  Bytes bytes = good_frame();
  bytes[2] = 2;
  expect_counted("frames_other_version", bytes);
}

TEST_F(RawL2Wire, CountsUnknownFlags) {
  Bytes bytes = good_frame();
  bytes[3] = 0x80;
  expect_counted("frames_unknown_flags", bytes);
}

TEST_F(RawL2Wire, CountsAnotherProfile) {
  expect_counted("frames_other_profile", good_frame(frame::ProfileId::kKilobot));
}

TEST_F(RawL2Wire, KeepsWhatComesBeforeABadPacketLength) {
  Bytes bytes = good_frame();
  bytes.push_back(0xFF);
  bytes[5] = static_cast<std::uint8_t>(bytes[5] + 1);  // the frame's length
  probe_->inject(bytes, kNeighbourMac);
  ASSERT_TRUE(run_until(io_, [&] { return counter(*link_, "frames_bad_packet_length") == 1; }));
  EXPECT_EQ(user_.received.size(), 1U);
}

TEST_F(RawL2Wire, DropsAndCountsItsOwnEcho) {
  const Bytes mac = WireProbe(*network_, 'a').mac();
  probe_->inject(good_frame(), mac);  // as an access point repeats it
  ASSERT_TRUE(run_until(io_, [&] { return counter(*link_, "own_echoes") == 1; }));
  EXPECT_TRUE(user_.received.empty());
}

TEST_F(RawL2Wire, DoesNotSeeFramesOfOtherEthertypes) {
  probe_->inject(good_frame(), kNeighbourMac, 0x0800);
  probe_->inject(good_frame(), kNeighbourMac, 0x88B6);
  probe_->inject(good_frame(), kNeighbourMac);
  ASSERT_TRUE(run_until(io_, [&] { return !user_.received.empty(); }));
  run_for(io_, 20ms);
  EXPECT_EQ(user_.received.size(), 1U);
}

TEST_F(RawL2Wire, HasItsFilterLockedAndIgnoresOutgoingFrames) {
  // The link's socket is the only packet socket of this process that is not the probe's.
  int locked = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int descriptor = std::stoi(entry.path().filename());
    int domain = 0;
    socklen_t size = sizeof domain;
    if (getsockopt(descriptor, SOL_SOCKET, SO_DOMAIN, &domain, &size) != 0) continue;
    if (domain != AF_PACKET) continue;
    int is_locked = 0;
    getsockopt(descriptor, SOL_SOCKET, SO_LOCK_FILTER, &is_locked, &size);
    if (is_locked == 0) continue;
    ++locked;
    int ignores_outgoing = 0;
    getsockopt(descriptor, SOL_PACKET, PACKET_IGNORE_OUTGOING, &ignores_outgoing, &size);
    EXPECT_EQ(ignores_outgoing, 1);
    EXPECT_NE(setsockopt(descriptor, SOL_SOCKET, SO_DETACH_FILTER, nullptr, 0), 0);
    EXPECT_THROW(attach_locked_ether_filter(descriptor, 0x0800), std::runtime_error);
  }
  EXPECT_EQ(locked, 1);
}

}  // namespace
}  // namespace swarmtalk::drivers
