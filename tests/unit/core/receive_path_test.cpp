// What becomes of packets when memory is short. (swarmtalk_test.cpp has the rest of their way.)
#include "swarmtalk/receive_path.hpp"

#include <gtest/gtest.h>

#include "swarmtalk/profiles/kilobot.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;
using testing::TestNode;

struct Slots20 : Kilobot {
  static constexpr uint16_t kFragmentSlots = 20;
};
/// Messages of 8 packets from several senders to a node with 20 slots.
class TightNode {
 public:
  TightNode() { receiver_.open(0); }
  /// Packets first..last of a message, with no time between.
  void hear(uint16_t sender, uint8_t first, uint8_t last) {
    TestNode<Slots20> node(sender);
    node.open(0);
    node.publisher->send(pattern(40).data(), 40);
    const auto packets = node.pull_all();
    for (uint8_t i = first; i <= last; ++i) receiver_.hear(packets[i]);
  }
  size_t delivered() const { return receiver_.received.size(); }
  int refused() const { return receiver_.node.counters().no_memory; }

 private:
  TestNode<Slots20> receiver_{99};
};

TEST(ReceivePath, BeginsWhateverFitsWhileLengthsAreUnknown) {
  TightNode sut;
  for (uint16_t sender = 1; sender <= 4; ++sender) sut.hear(sender, 0, 0);
  EXPECT_EQ(sut.refused(), 0);
}

TEST(ReceivePath, BeginsNoThirdMessageThatWouldNotFitBesideTwoThatJustBegan) {
  TightNode sut;
  sut.hear(50, 0, 7);
  ASSERT_EQ(sut.delivered(), 1u);
  for (uint16_t sender = 1; sender <= 3; ++sender) sut.hear(sender, 0, 0);
  EXPECT_EQ(sut.refused(), 1) << "3 times 7 packets are 21";
  sut.hear(1, 1, 7);
  sut.hear(2, 1, 7);
  sut.hear(3, 1, 7);
  EXPECT_EQ(sut.delivered(), 3u);
}

TEST(ReceivePath, BeginsAThirdMessageThatWillFitWhenTheFirstEnds) {
  TightNode sut;
  sut.hear(50, 0, 7);
  sut.hear(1, 0, 1);
  sut.hear(2, 0, 0);
  sut.hear(3, 0, 0);  // 7 + 6 + 6 when the first has 7
  EXPECT_EQ(sut.refused(), 0);
  for (uint8_t i = 1; i < 8; ++i) {
    if (i < 7) sut.hear(1, static_cast<uint8_t>(i + 1), static_cast<uint8_t>(i + 1));
    sut.hear(2, i, i);
    sut.hear(3, i, i);
  }
  EXPECT_EQ(sut.delivered(), 4u);
}

TEST(ReceivePath, MakesNoForecastWhilePacketsAreLost) {
  TightNode sut;
  sut.hear(50, 0, 7);
  sut.hear(1, 0, 0);
  sut.hear(2, 0, 0);
  sut.hear(2, 2, 2);  // one is missing
  sut.hear(3, 0, 0);
  sut.hear(4, 0, 0);
  EXPECT_EQ(sut.refused(), 0);
}

}  // namespace
}  // namespace swarmtalk::core
