#include "redundancy/repair_sender.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/redundancy/wifi_packets.hpp"

namespace swarmtalk::redundancy {
namespace {

using testing::header_of;
using testing::kFull;
using testing::packets_of;

constexpr std::uint64_t kWait = RepairSender::kCopyWaitUs;

class RepairSenderTest : public ::testing::Test {
 protected:
  void send(std::uint32_t number, std::size_t size, std::uint64_t now_us) {
    for (Bytes packet : packets_of(header_of(number, size))) sender_.sent(packet, ++frame_, now_us);
  }
  Bytes take_parity(std::uint64_t now_us) {
    Bytes packet(sender_.parity_bytes());
    sender_.take_parity(packet, now_us);
    return packet;
  }
  Bytes take_copy(std::uint64_t now_us) {
    Bytes packet(sender_.copy_bytes(frame_ + 1).value());
    sender_.take_copy(packet, ++frame_, now_us);
    return packet;
  }

  RepairSender sender_;
  std::uint64_t frame_ = 0;
};

TEST_F(RepairSenderTest, MakesNothingThatNobodyAskedFor) {
  EXPECT_TRUE(sender_.is_idle());
  send(1, 4 * kFull, 0);
  send(2, 20, 0);
  EXPECT_TRUE(sender_.is_idle());
  EXPECT_FALSE(sender_.has_parity());
  EXPECT_FALSE(sender_.copy_bytes(99));
}

TEST_F(RepairSenderTest, MarksTheMessageThatWasAskedForAndNoOther) {
  sender_.protect(7, 5, 3);
  for (const auto& [number, channel, parities] :
       {std::tuple{5, 8, 0}, {5, 7, 3}, {5, 7, 3}, {6, 7, 0}, {5, 7, 0}}) {
    Bytes packet = packets_of(header_of(static_cast<std::uint32_t>(number), 2 * kFull,
                                        static_cast<std::uint16_t>(channel)))[0];
    sender_.sent(packet, 1, 0);
    EXPECT_EQ(ParitiesField::get(packet.data()), parities) << number << " on " << channel;
  }
}

TEST_F(RepairSenderTest, LeavesPacketsOfOthersAlone) {
  sender_.protect(7, 1, 3);
  Header header = header_of(1, 2 * kFull);
  header.hops = 1;
  Bytes packet = packets_of(header)[0];
  const Bytes before = packet;
  sender_.sent(packet, 1, 0);
  EXPECT_EQ(packet, before);
}

TEST_F(RepairSenderTest, ACopyOfTheWholeMessageIsMarkedAndMakesNoMoreParities) {
  sender_.protect(7, 1, 2);
  send(1, 3 * kFull, 0);
  take_parity(0);
  take_parity(0);
  Bytes again = packets_of(header_of(1, 3 * kFull))[2];
  sender_.sent(again, ++frame_, 0);
  EXPECT_EQ(ParitiesField::get(again.data()), 2);
  EXPECT_FALSE(sender_.has_parity());
}

TEST_F(RepairSenderTest, AParityPacketCountsItsWait) {
  Header header = header_of(1, 3000);
  sender_.protect(7, 1, 1);
  for (Bytes packet : packets_of(header, true)) sender_.sent(packet, ++frame_, 1000);
  const Bytes parity = take_parity(41'000);
  EXPECT_EQ(Wire::timestamp(parity.data(), static_cast<Wire::PacketSize>(parity.size())), 40'000u);
}

TEST_F(RepairSenderTest, ALateCopyIsThePacketItself) {
  sender_.protect(7, 1, 1);
  send(1, 24, 0);
  EXPECT_EQ(take_copy(10), packets_of(header_of(1, 24))[0]);
  EXPECT_FALSE(sender_.copy_bytes(UINT64_MAX));
  EXPECT_EQ(sender_.sent_repairs(), 1u);
}

TEST_F(RepairSenderTest, NoTwoCopiesOfAMessageLeaveInOneFrame) {
  sender_.protect(7, 1, 2);
  send(1, 24, 0);
  EXPECT_FALSE(sender_.copy_bytes(frame_)) << "not with the message";
  take_copy(10);
  EXPECT_FALSE(sender_.copy_bytes(frame_)) << "not with its first copy";
  take_copy(20);
  EXPECT_FALSE(sender_.copy_bytes(UINT64_MAX));
}

TEST_F(RepairSenderTest, LateCopiesComeAfterTheMessageThatLeavesOnceMore) {
  sender_.protect(7, 1, 1);
  send(1, 24, 0);
  sender_.repeats(7);
  EXPECT_FALSE(sender_.copy_bytes(UINT64_MAX));
  EXPECT_FALSE(sender_.next_due_us());
  send(1, 24, 20'000);
  EXPECT_FALSE(sender_.copy_bytes(frame_));
  EXPECT_TRUE(sender_.copy_bytes(frame_ + 1));
  EXPECT_EQ(sender_.next_due_us(), 20'000 + kWait);
  sender_.repeats(7);
  sender_.forget(7);
  EXPECT_TRUE(sender_.copy_bytes(frame_ + 1)) << "it was given up";
}

TEST_F(RepairSenderTest, ACopyIsDueWhenItHasWaitedForLong) {
  EXPECT_FALSE(sender_.next_due_us());
  sender_.protect(7, 1, 2);
  send(1, 24, 5000);
  EXPECT_EQ(sender_.next_due_us(), 5000 + kWait);
  take_copy(100'000);
  EXPECT_EQ(sender_.next_due_us(), 100'000 + kWait) << "the second waits from the first on";
}

TEST_F(RepairSenderTest, DropsTheOldestOfTooMany) {
  for (std::uint32_t number = 1; number <= RepairSender::kMostCopies + 3; ++number) {
    sender_.protect(7, number, 2);
    send(number, 24, number);
  }
  EXPECT_EQ(sender_.dropped(), 6u);
  EXPECT_EQ(Wire::decode(take_copy(0).data()).message, 4u);
  sender_.protect(7, 1000, 12);
  for (int i = 0; i < 5; ++i) {
    sender_.protect(7, static_cast<std::uint32_t>(1000 + i), 12);
    send(static_cast<std::uint32_t>(1000 + i), 2 * kFull, 0);
  }
  EXPECT_EQ(sender_.dropped(), 6u + 60 - RepairSender::kMostParities);
}

}  // namespace
}  // namespace swarmtalk::redundancy
