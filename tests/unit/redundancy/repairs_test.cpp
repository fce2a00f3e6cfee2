// What goes into which frame.
#include "redundancy/repairs.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <vector>

#include "tests/unit/redundancy/wifi_packets.hpp"

namespace swarmtalk::redundancy {
namespace {

using testing::header_of;
using testing::kFull;
using testing::packets_of;
using testing::protected_packets;

constexpr std::size_t kRoom = 1470;

class RepairsTest : public ::testing::Test {
 protected:
  /// A node has this to send.
  void give(std::uint32_t number, std::size_t size, unsigned repairs, std::uint16_t channel = 7) {
    if (repairs != 0) repairs_.sender().protect(channel, number, repairs);
    for (Bytes& packet : packets_of(header_of(number, size, channel))) {
      node_.push_back(std::move(packet));
    }
  }
  std::size_t node_bytes() const { return node_.empty() ? 0 : node_.front().size(); }

  /// Fills a frame as a link does.
  std::vector<Header> frame(std::size_t room = kRoom) {
    std::vector<Header> packets;
    repairs_.begin_frame();
    while (true) {
      const Repairs::Next next = repairs_.choose(node_bytes(), room, now_us_);
      if (next == Repairs::Next::kNothing) return packets;
      Bytes packet(room);
      if (next == Repairs::Next::kNode) {
        packet = node_.front();
        node_.pop_front();
      }
      const std::size_t bytes = repairs_.take(next, packet, now_us_);
      packets.push_back(Wire::decode(packet.data()));
      room -= bytes + 2;
    }
  }
  static std::vector<std::uint32_t> numbers(const std::vector<Header>& packets) {
    std::vector<std::uint32_t> numbers;
    for (const Header& packet : packets) numbers.push_back(packet.message);
    return numbers;
  }
  using Numbers = std::vector<std::uint32_t>;

  Repairs repairs_;
  std::deque<Bytes> node_;
  std::uint64_t now_us_ = 0;
};

TEST_F(RepairsTest, ALateCopyRidesInTheNextFrameInFrontOfWhatIsNew) {
  give(1, 24, 1);
  EXPECT_EQ(numbers(frame()), (Numbers{1}));
  EXPECT_EQ(repairs_.waiting_bytes(node_bytes(), now_us_), 0u) << "no frame is made for it";
  EXPECT_TRUE(frame().empty());
  give(2, 24, 1);
  EXPECT_EQ(numbers(frame()), (Numbers{1, 2}));
  give(3, 24, 1);
  EXPECT_EQ(numbers(frame()), (Numbers{2, 3}));
}

TEST_F(RepairsTest, ALateCopyWithoutAFrameLeavesAloneInTheEnd) {
  give(1, 24, 1);
  frame();
  now_us_ += RepairSender::kCopyWaitUs;
  EXPECT_GT(repairs_.waiting_bytes(0, now_us_), 0u);
  EXPECT_EQ(numbers(frame()), (Numbers{1}));
  EXPECT_EQ(repairs_.waiting_bytes(0, now_us_), 0u);
}

TEST_F(RepairsTest, ALateCopyTakesNoRoomFromWhatIsNew) {
  give(1, 200, 1);
  frame();
  give(2, 1300, 0);
  EXPECT_EQ(numbers(frame()), (Numbers{2}));
  give(3, 1200, 0);
  EXPECT_EQ(numbers(frame()), (Numbers{1, 3}));
}

TEST_F(RepairsTest, ACopyThatIsDueGoesEvenWhereFramesAreAlwaysFull) {
  give(1, 200, 1);
  frame();
  now_us_ += RepairSender::kCopyWaitUs;
  give(2, 1300, 0);
  EXPECT_EQ(numbers(frame()), (Numbers{1}));
  EXPECT_EQ(numbers(frame()), (Numbers{2}));
}

TEST_F(RepairsTest, ParityPacketsLeaveInFramesOfTheirOwn) {
  give(1, 2 * kFull + 100, 2);
  EXPECT_EQ(frame(9000).size(), 3u) << "the message fits into one frame";
  give(2, 24, 0);
  EXPECT_EQ(numbers(frame(9000)), (Numbers{1}));
  EXPECT_GT(repairs_.waiting_bytes(node_bytes(), now_us_), 0u) << "the link goes on";
  EXPECT_EQ(numbers(frame(9000)), (Numbers{1}));
  EXPECT_EQ(numbers(frame(9000)), (Numbers{2}));
}

TEST_F(RepairsTest, LateCopiesOfOtherMessagesMayFollowAParityPacket) {
  give(1, 24, 1, 8);
  frame();
  give(2, 2 * kFull, 1);
  frame(1440);  // no room for the copy
  frame(1440);
  const std::vector<Header> packets = frame();
  ASSERT_EQ(packets.size(), 2u);
  EXPECT_EQ(packets[0].channel, 7);
  EXPECT_EQ(packets[0].sequence, 2);
  EXPECT_EQ(packets[1].channel, 8);
}

TEST_F(RepairsTest, OthersParityPacketsTakeTurnsWithTheNode) {
  repairs_.relay().limit(16, 0);
  const std::vector<Bytes> others = protected_packets(header_of(50, 2 * kFull, 9, 3), 3);
  for (std::size_t i = 2; i < others.size(); ++i) {
    EXPECT_TRUE(repairs_.receive(others[i], true, false, false, 0).empty());
  }
  for (std::uint32_t number = 1; number <= 3; ++number) give(number, kFull, 0);
  std::vector<std::uint32_t> left;
  for (int i = 0; i < 6; ++i) {
    const std::vector<Header> packets = frame();
    ASSERT_EQ(packets.size(), 1u);
    left.push_back(packets[0].message);
  }
  EXPECT_EQ(left, (Numbers{1, 50, 2, 50, 3, 50}));
  EXPECT_TRUE(repairs_.is_idle());
}

TEST_F(RepairsTest, RecoversOnlyWhereSomebodyListensAndNothingOfItsOwn) {
  const std::vector<Bytes> all = protected_packets(header_of(1, 2 * kFull), 1);
  repairs_.receive(all[0], false, false, false, 0);
  EXPECT_TRUE(repairs_.receive(all[2], true, false, false, 0).empty());
  repairs_.receive(all[0], false, true, true, 0);
  EXPECT_TRUE(repairs_.receive(all[2], true, true, true, 0).empty());
  EXPECT_TRUE(repairs_.receive(all[0], false, false, true, 0).empty());
  EXPECT_EQ(repairs_.receive(all[2], true, false, true, 0).size(), 1u);
  EXPECT_EQ(repairs_.received(), 3u);
}

TEST_F(RepairsTest, APacketThatTheNodeHasRefusedAndThatIsNoParityPacketIsDropped) {
  Bytes bad = protected_packets(header_of(1, 2 * kFull), 1)[0];
  bad.pop_back();
  EXPECT_TRUE(repairs_.receive(bad, true, false, true, 0).empty());
  EXPECT_EQ(repairs_.received(), 0u);
}

}  // namespace
}  // namespace swarmtalk::redundancy
