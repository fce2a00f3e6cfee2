// What a node forgets while time passes: with few calls, without any, and in the very call in which
// something new comes under an old name. Message numbers have 4 bits, so names do come back.
#include <gtest/gtest.h>

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;
using testing::TestNode;
using ::testing::ValuesIn;
using Packets = std::vector<Bytes>;

/// A sender's messages of whole packets, each with bytes of its own.
template <class P>
class Sender {
 public:
  Sender(uint16_t id, uint32_t ttl, uint32_t channel = 0) : node_(id) { node_.open(channel, ttl); }
  Packets next(size_t packets) {
    bytes_ = pattern(packets * Wire<P>::kPayloadBytes, ++seed_);
    node_.publisher->send(bytes_.data(), static_cast<uint16_t>(bytes_.size()));
    return node_.pull_all();
  }
  /// The next one with the number of the last.
  Packets next_of_same_number(size_t packets) {
    for (uint32_t number = 0; number < Wire<P>::kMessageMask; ++number) next(1);
    return next(packets);
  }
  const Bytes& bytes() const { return bytes_; }  // of the last message

 private:
  TestNode<P> node_;
  Bytes bytes_;
  uint8_t seed_ = 0;
};

constexpr uint16_t kSenders = 12;

/// What is heard while time passes: one-hop messages of somebody else.
struct Meanwhile {
  uint32_t every;    // ticks; 0: nothing is heard
  uint32_t channel;  // kOpen, or one that the receiver does not have
};
constexpr uint32_t kOpen = 1;
constexpr uint32_t kNotHere = 2;
constexpr Meanwhile kSilence = {0, kOpen};

/// A receiver on channel 0, and somebody else whom it hears.
template <class P>
class Place {
 public:
  Place(uint32_t ttl, const Meanwhile& meanwhile)
      : meanwhile_(meanwhile), other_(98, 0, meanwhile.channel) {
    receiver.port.now = 5000;
    receiver.open(kOpen, 0);
    receiver.open(0, ttl);
  }
  void hear_other() { receiver.hear(other_.next(1)[0]); }
  void pass(uint32_t ticks) {
    const uint32_t end = receiver.port.now + ticks;
    while (meanwhile_.every != 0 && end - receiver.port.now > meanwhile_.every) {
      receiver.port.now += meanwhile_.every;
      hear_other();
    }
    receiver.port.now = end;
    receiver.received.clear();
  }
  TestNode<P> receiver{99};

 private:
  Meanwhile meanwhile_;
  Sender<P> other_;
};

/// Of kSenders' messages of two packets the first packets come, `pause` ticks before the second
/// packets of later messages with the same numbers. One message of somebody else comes before them:
/// its record is over at once, and there before the others.
/// @return messages put together
template <class P>
size_t joined(uint32_t ttl, uint32_t pause, const Meanwhile& meanwhile, bool same_message) {
  Place<P> place(ttl, meanwhile);
  place.hear_other();
  std::vector<Bytes> last;
  for (uint16_t id = 1; id <= kSenders; ++id) {
    Sender<P> sender(id, ttl);
    const Packets before = sender.next(2);
    place.receiver.hear(before[0]);
    last.push_back(same_message ? before[1] : sender.next_of_same_number(2)[1]);
  }
  place.pass(pause);
  for (const Bytes& packet : last) place.receiver.hear(packet);
  return place.receiver.received.size();
}

/// Whether a message of one packet is delivered `pause` ticks after another one of the same name.
template <class P>
bool comes_through(uint32_t ttl, uint32_t pause, const Meanwhile& meanwhile) {
  Place<P> place(ttl, meanwhile);
  place.hear_other();
  Sender<P> sender(1, ttl);
  place.receiver.hear(sender.next(1)[0]);
  place.pass(pause);
  place.receiver.hear(sender.next_of_same_number(1)[0]);
  return place.receiver.received.size() == 1;
}

/// What is tested with each profile.
struct Node {
  const char* profile;
  size_t (*joined)(uint32_t ttl, uint32_t pause, const Meanwhile& meanwhile, bool same_message);
  bool (*comes_through)(uint32_t ttl, uint32_t pause, const Meanwhile& meanwhile);
};
template <class P>
constexpr Node node_of(const char* profile) {
  return {profile, &joined<P>, &comes_through<P>};
}

struct Pause {
  Node node;
  uint32_t ttl;
  uint32_t ticks;
};
std::string name_of(const ::testing::TestParamInfo<Pause>& info) {
  return std::string(info.param.node.profile) + std::to_string(info.param.ticks) + "Ticks";
}
std::ostream& operator<<(std::ostream& out, const Pause& pause) {
  return out << pause.ticks << " ticks";
}
std::vector<Pause> pauses(uint32_t ttl, const std::vector<uint32_t>& ticks) {
  std::vector<Pause> all;
  for (const Node& node : {node_of<Kilobot>("Kilobot"), node_of<Footbot>("Footbot"),
                           node_of<Classic2020>("Classic2020")}) {
    for (const uint32_t each : ticks) all.push_back({node, ttl, each});
  }
  return all;
}

// 65,600 is 64 more than a clock of 16 bits can tell.
class AgeingWithFewCalls : public ::testing::TestWithParam<Pause> {};
TEST_P(AgeingWithFewCalls, JoinsNoFragmentsOfTwoMessages) {
  const Pause& pause = GetParam();
  for (const uint32_t channel : {kOpen, kNotHere}) {
    EXPECT_EQ(pause.node.joined(pause.ttl, pause.ticks, {100, channel}, false), 0u) << channel;
  }
}
TEST_P(AgeingWithFewCalls, TakesNoNewMessageForACopy) {
  const Pause& pause = GetParam();
  for (const uint32_t channel : {kOpen, kNotHere}) {
    EXPECT_TRUE(pause.node.comes_through(pause.ttl, pause.ticks, {100, channel})) << channel;
  }
}
INSTANTIATE_TEST_SUITE_P(OneHop, AgeingWithFewCalls,
                         ValuesIn(pauses(0, {256, 320, 512, 65536, 65540, 65600})), name_of);
INSTANTIATE_TEST_SUITE_P(Flood, AgeingWithFewCalls,
                         ValuesIn(pauses(3, {4096, 4160, 8192, 65536, 65600, 67000})), name_of);

class AgeingWithoutCalls : public ::testing::TestWithParam<Pause> {};
TEST_P(AgeingWithoutCalls, JoinsNoFragmentsOfTwoMessages) {
  EXPECT_EQ(GetParam().node.joined(GetParam().ttl, GetParam().ticks, kSilence, false), 0u);
}
TEST_P(AgeingWithoutCalls, TakesNoNewMessageForACopy) {
  EXPECT_TRUE(GetParam().node.comes_through(GetParam().ttl, GetParam().ticks, kSilence));
}
INSTANTIATE_TEST_SUITE_P(OneHop, AgeingWithoutCalls, ValuesIn(pauses(0, {65600, 70000, 1000000})),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Flood, AgeingWithoutCalls, ValuesIn(pauses(3, {65600, 70000, 1000000})),
                         name_of);

class YoungFragments : public ::testing::TestWithParam<Pause> {};
TEST_P(YoungFragments, AreJoined) {
  const Pause& pause = GetParam();
  for (const uint32_t channel : {kOpen, kNotHere}) {
    EXPECT_EQ(pause.node.joined(pause.ttl, pause.ticks, {10, channel}, true), kSenders) << channel;
  }
}
INSTANTIATE_TEST_SUITE_P(OneHop, YoungFragments, ValuesIn(pauses(0, {50})), name_of);
INSTANTIATE_TEST_SUITE_P(Flood, YoungFragments, ValuesIn(pauses(3, {50})), name_of);

/// Hears the first packet of a message and, after its time, all of the next one of that name.
/// @param calls  of the node before, so that what it does every few calls falls on any of them
template <class P>
void expect_successor(uint32_t ttl, size_t packets, int calls) {
  SCOPED_TRACE("TTL " + std::to_string(ttl) + ", " + std::to_string(packets) + " packets, " +
               std::to_string(calls) + " calls");
  TestNode<P> receiver(99);
  receiver.port.now = 5000;
  receiver.open(0, ttl);
  Sender<P> sender(1, ttl);
  receiver.hear(sender.next(2)[0]);
  for (int call = 0; call < calls; ++call) receiver.pull();
  receiver.port.now += ttl == 0 ? 406 : 5014;  // longer than the first packet is kept
  for (const Bytes& packet : sender.next_of_same_number(packets)) receiver.hear(packet);
  ASSERT_EQ(receiver.received.size(), 1u);
  EXPECT_EQ(receiver.received[0].bytes, sender.bytes());
}
template <class P>
void expect_successors() {
  for (const uint32_t ttl : {0u, 3u}) {
    for (const size_t packets : {1u, 2u}) {
      for (int calls = 0; calls < 16; ++calls) expect_successor<P>(ttl, packets, calls);
    }
  }
}

TEST(Ageing, DeliversTheMessageThatBeginsAsItsPredecessorExpiresKilobot) {
  expect_successors<Kilobot>();
}
TEST(Ageing, DeliversTheMessageThatBeginsAsItsPredecessorExpiresFootbot) {
  expect_successors<Footbot>();
}
TEST(Ageing, DeliversTheMessageThatBeginsAsItsPredecessorExpiresClassic2020) {
  expect_successors<Classic2020>();
}

/// A narrow clock, and timestamps that tell more than it counts.
template <uint8_t kBits>
struct NarrowClock : Kilobot {
  static constexpr uint8_t kClockBits = kBits;
  static constexpr uint8_t kTimestampBits = kBits * 2;
  static constexpr uint32_t kFloodTicks = 120;
  static constexpr uint32_t kFloodSurelyTicks = 60;
};
template <class P>
class LongWait : public ::testing::Test {};
using NarrowClocks = ::testing::Types<NarrowClock<8>, NarrowClock<16>>;
TYPED_TEST_SUITE(LongWait, NarrowClocks);

TYPED_TEST(LongWait, OfAMessageThatTheLinkDoesNotTakeIsToldWhole) {
  constexpr uint32_t kWait = (1u << TypeParam::kClockBits) * 2 + 7;
  TestNode<TypeParam> sender(1);
  sender.open(8, 3, true);
  sender.publisher->send(pattern(1).data(), 1);
  sender.port.now += kWait;
  TestNode<TypeParam> receiver(2);
  receiver.open(8, 3, true);
  receiver.hear(sender.pull());
  ASSERT_EQ(receiver.received.size(), 1u);
  EXPECT_EQ(receiver.received[0].reception.delay_ticks, kWait);
}
TYPED_TEST(LongWait, OfAPacketToSendOnIsToldWholeWhileOthersAreHeard) {
  constexpr uint32_t kWait = (1u << TypeParam::kClockBits) * 2 + 7;
  TestNode<TypeParam> sender(1);
  sender.open(8, 3, true);
  sender.publisher->send(pattern(1).data(), 1);
  TestNode<TypeParam> other(3);
  other.open(9, 0, true);
  TestNode<TypeParam> relay(4);
  relay.hear(sender.pull());
  const uint32_t end = relay.port.now + kWait;
  while (relay.port.now < end) {
    relay.port.now += end - relay.port.now < 100 ? end - relay.port.now : 100;
    other.publisher->send(pattern(1).data(), 1);
    relay.hear(other.pull());
  }
  TestNode<TypeParam> receiver(2);
  receiver.open(8, 3, true);
  receiver.hear(relay.pull());
  ASSERT_EQ(receiver.received.size(), 1u);
  EXPECT_EQ(receiver.received[0].reception.delay_ticks, kWait);
}

}  // namespace
}  // namespace swarmtalk::core
