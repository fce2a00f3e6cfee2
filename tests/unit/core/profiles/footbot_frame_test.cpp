#include "swarmtalk/profiles/footbot_frame.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;
using Node = testing::TestNode<Footbot>;

constexpr RangeBearingSensing kNear = {50, 0.5f};

std::unique_ptr<Node> make(uint16_t id) {
  auto node = std::make_unique<Node>(id);
  node->open(1);
  return node;
}
Bytes fill(Node& node) {
  Bytes board(FootbotFrame::kBytes, 0xEE);
  FootbotFrame::fill(node.node, board.data());
  return board;
}

TEST(FootbotFrame, IsTheLinkByteThePacketAndZeros) {
  auto node = make(42);
  for (int message = 1; message <= 3; ++message) {
    const uint8_t bytes[] = {'A', 'B'};
    node->publisher->send(bytes, 2);
    if (message < 3) fill(*node);
  }
  const uint8_t sum = static_cast<uint8_t>(0x2A + 0x31 + 0x10 + 'A' + 'B');
  EXPECT_EQ(fill(*node), (Bytes{0x86, 0x2A, 0x31, 0x10, 'A', 'B', sum, 0, 0, 0}));
}

TEST(FootbotFrame, IsAllZerosInAStepWithoutAPacket) {
  auto node = make(42);
  EXPECT_EQ(fill(*node), Bytes(10, 0));
  node->publisher->send(pattern(5).data(), 5);
  EXPECT_EQ(fill(*node)[0], 0x89);
  EXPECT_EQ(fill(*node), Bytes(10, 0)) << "a packet is on the board for one step";
}

TEST(FootbotFrame, CarriesEveryLengthExactly) {
  auto sender = make(1);
  auto receiver = make(2);
  for (uint16_t size = 0; size <= Wire<Footbot>::kMessageBytes; ++size) {
    receiver->received.clear();
    receiver->port.now += 16;  // numbers come back after sixteen messages
    const Bytes message = pattern(size);
    ASSERT_EQ(sender->publisher->send(message.data(), size), Error::kOk);
    uint16_t packets = 0;
    for (Bytes board = fill(*sender); board[0] != 0; board = fill(*sender), ++packets) {
      EXPECT_EQ(FootbotFrame::read(receiver->node, board.data(), kNear), Error::kOk);
    }
    EXPECT_EQ(packets, size == 0 ? 1 : (size + 4) / 5);
    ASSERT_EQ(receiver->received.size(), 1u) << size;
    EXPECT_EQ(receiver->received[0].bytes, message);
    EXPECT_EQ(receiver->received[0].reception.sensing.distance, 50);
    EXPECT_EQ(receiver->received[0].reception.sensing.bearing_rad, 0.5f);
  }
}

TEST(FootbotFrame, IsReadOnceWhileItsLinkByteSaysOld) {
  auto sender = make(1);
  auto receiver = make(2);
  sender->publisher->send(pattern(3).data(), 3);
  Bytes board = fill(*sender);
  FootbotFrame::read(receiver->node, board.data(), kNear);
  board[0] = static_cast<uint8_t>(board[0] & ~FootbotFrame::kNew);
  for (int step = 0; step < 100; ++step) {
    ++receiver->port.now;
    EXPECT_EQ(FootbotFrame::read(receiver->node, board.data(), kNear), Error::kOk);
  }
  EXPECT_EQ(receiver->received.size(), 1u);
  EXPECT_EQ(receiver->node.counters().packets_received, 1u);
}

TEST(FootbotFrame, RefusesLengthsThatCannotBe) {
  auto receiver = make(2);
  for (uint8_t length = 0; length < 16; ++length) {
    Bytes board(17, 0);
    board[2] = board[length] = 1;  // the last packet of its message; the checksum
    board[0] = static_cast<uint8_t>(FootbotFrame::kNew | length);
    const Error expected = length < 4 || length > 9 ? Error::kBadPacket : Error::kOk;
    EXPECT_EQ(FootbotFrame::read(receiver->node, board.data(), kNear), expected) << +length;
  }
  EXPECT_EQ(receiver->node.counters().bad_packets, 10u);
}

TEST(Footbot, RefusesAPacketThatIsNotFullAndNotTheLast) {
  auto sender = make(1);
  auto receiver = make(2);
  sender->publisher->send(pattern(7).data(), 7);
  Bytes first = sender->pull();
  first.resize(first.size() - 2);  // four bytes of payload, sealed anew
  first.push_back(sum8(first.data(), static_cast<uint16_t>(first.size())));
  EXPECT_EQ(receiver->hear(first), Error::kBadPacket);
  Bytes last = sender->pull();
  last.resize(3);  // no payload behind a first packet
  last.push_back(sum8(last.data(), 3));
  EXPECT_EQ(receiver->hear(last), Error::kBadPacket);
}

TEST(Footbot, NeedsItsTimestampWhole) {
  auto receiver = make(2);
  receiver->open(9, 0, true);
  Bytes packet = {1, 0x11, 0x90, 5};  // one byte where the timestamp has two
  packet.push_back(sum8(packet.data(), 4));
  EXPECT_EQ(receiver->hear(packet), Error::kBadPacket);
  packet = {1, 0x11, 0x90, 5, 0};  // a timestamp and no payload: a message of 0 bytes
  packet.push_back(sum8(packet.data(), 5));
  EXPECT_EQ(receiver->hear(packet), Error::kOk);
  ASSERT_EQ(receiver->received.size(), 1u);
  EXPECT_TRUE(receiver->received[0].bytes.empty());
  EXPECT_EQ(receiver->received[0].reception.delay_ticks, 5);
}

}  // namespace
}  // namespace swarmtalk::core
