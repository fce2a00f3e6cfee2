#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <set>

#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/property/random_air.hpp"
#include "tests/support/profiles.hpp"

namespace swarmtalk::core::testing {
namespace {

/// A header with every field drawn over its whole range comes back from its bytes.
template <class P>
void header_round_trip() {
  using W = Wire<P>;
  typename W::Header header;
  header.node = static_cast<typename W::NodeId>(*rc::gen::arbitrary<uint32_t>() & W::kNoNode);
  header.message =
      static_cast<typename W::MessageNumber>(*rc::gen::arbitrary<uint32_t>() & W::kMessageMask);
  header.sequence = static_cast<typename W::Sequence>(*rc::gen::arbitrary<uint32_t>() &
                                                      low_bits(P::kSequenceBits));
  header.end = *rc::gen::arbitrary<bool>();
  header.channel =
      static_cast<typename W::ChannelId>(*rc::gen::arbitrary<uint32_t>() & W::kChannelMax);
  header.ttl = static_cast<uint8_t>(*rc::gen::arbitrary<uint8_t>() & W::kTtlMax);
  header.hops = static_cast<uint8_t>(*rc::gen::arbitrary<uint8_t>() & low_bits(P::kHopsBits));
  header.size =
      static_cast<decltype(header.size)>(*rc::gen::arbitrary<uint16_t>() & low_bits(P::kSizeBits));
  header.epoch =
      static_cast<typename W::Epoch>(*rc::gen::arbitrary<uint16_t>() & low_bits(P::kEpochBits));
  header.has_delay = P::kTimestampedBits != 0 ? *rc::gen::arbitrary<bool>()
                                              : header.channel >= P::kTimestampedFrom;
  header.crossed_gateway = P::kGatewayBits != 0 && *rc::gen::arbitrary<bool>();
  uint8_t packet[W::kHeaderBytes + 1];
  packet[W::kHeaderBytes] = 0x5A;
  W::encode(header, packet);
  const auto back = W::decode(packet);
  RC_ASSERT(packet[W::kHeaderBytes] == 0x5A);
  RC_ASSERT(back.node == header.node && back.message == header.message);
  RC_ASSERT(back.sequence == header.sequence && back.end == header.end);
  RC_ASSERT(back.channel == header.channel && back.ttl == header.ttl);
  RC_ASSERT(back.hops == header.hops && back.size == header.size && back.epoch == header.epoch);
  RC_ASSERT(back.has_delay == header.has_delay);
  RC_ASSERT(back.crossed_gateway == header.crossed_gateway);
}

/// Widths that fit no byte: 10 + 5 + 3 + 1 + 3 + 6 bits.
struct OddWidths : ProfileDefaults {
  using Sensing = DistanceSensing;
  static constexpr uint16_t kMtuBytes = 12;
  static constexpr uint8_t kNodeBits = 10;
  static constexpr uint8_t kMessageBits = 5;
  static constexpr uint8_t kChannelBits = 3;
  static constexpr uint8_t kTtlBits = 6;
  static constexpr uint8_t kTimestampBits = 13;
  static constexpr Checksum kChecksum = Checksum::kCrc8;
};

RC_GTEST_PROP(Header, RoundTripsInEveryProfile, ()) {
  header_round_trip<Kilobot>();
  header_round_trip<Classic2020Format<2>>();
  header_round_trip<Footbot>();
  header_round_trip<Wifi>();
  header_round_trip<OddWidths>();
}

/// What was sent, and what of it arrived.
struct Story {
  std::vector<Bytes> messages;
  std::vector<uint16_t> packets;
  std::vector<std::vector<InAir>> by_sender;
};

template <class P>
Story draw_story(size_t senders, size_t each, uint16_t max_bytes) {
  Story story;
  for (size_t sender = 0; sender < senders; ++sender) {
    TestNode<P> node(static_cast<uint16_t>(10 + sender));
    node.open(3);
    story.by_sender.emplace_back();
    for (size_t n = 0; n < each; ++n) {
      const auto size = *rc::gen::inRange<uint16_t>(1, static_cast<uint16_t>(max_bytes + 1));
      Bytes bytes = pattern(size, static_cast<uint8_t>(17 * sender + 31 * n));
      bytes[0] = static_cast<uint8_t>(story.messages.size());  // no two messages are equal
      RC_ASSERT(node.publisher->send(bytes.data(), size) == Error::kOk);
      const auto pulled = node.pull_all();
      for (const Bytes& packet : pulled) {
        story.by_sender.back().push_back({packet, story.messages.size()});
      }
      if (P::kPadded) {
        bytes.resize((bytes.size() + Wire<P>::kPayloadBytes - 1) / Wire<P>::kPayloadBytes *
                     Wire<P>::kPayloadBytes);
      }
      story.messages.push_back(bytes);
      story.packets.push_back(static_cast<uint16_t>(pulled.size()));
    }
  }
  return story;
}

/// Whatever the air does: each message at most once, byte for byte; exactly those of which every
/// packet came.
template <class P>
void delivers_exactly_what_came(size_t senders, size_t each, uint16_t max_bytes) {
  const Story story = draw_story<P>(senders, each, max_bytes);
  const AirChoices choices{*rc::gen::arbitrary<bool>(), *rc::gen::arbitrary<bool>(),
                           *rc::gen::arbitrary<bool>()};
  const auto air = draw_air(story.by_sender, choices);
  auto receiver = std::make_unique<TestNode<P>>(uint16_t{99});
  receiver->port.now = *rc::gen::element(0u, 0xFFF0u, 0xFFFFFFF0u, 250u);
  receiver->open(3);
  std::map<size_t, std::set<Bytes>> came;
  for (const InAir& in_air : air) {
    receiver->hear(in_air.packet);
    came[in_air.message].insert(in_air.packet);
    receiver->port.now += *rc::gen::inRange<uint32_t>(0, 2);
  }
  std::multiset<Bytes> expected;
  for (const auto& [message, packets] : came) {
    if (packets.size() == story.packets[message]) expected.insert(story.messages[message]);
  }
  std::multiset<Bytes> delivered;
  for (const auto& received : receiver->received) delivered.insert(received.bytes);
  RC_ASSERT(delivered == expected);
}

/// Time stands still enough for neither numbers nor ages to matter: 3 senders, 4 messages each.
RC_GTEST_PROP(Delivery, IsExactInThePaperFormat, ()) {
  delivers_exactly_what_came<RoomForAll>(3, 4, 40);
}
RC_GTEST_PROP(Delivery, IsExactOnTheFootbot, ()) {
  delivers_exactly_what_came<Footbot>(3, 4, 40);
}
RC_GTEST_PROP(Delivery, IsExactOnWifi, ()) {
  delivers_exactly_what_came<Wifi>(4, 6, 9000);
}

/// With little memory messages may be missing, but none is wrong or comes twice.
RC_GTEST_PROP(Delivery, IsNeverWrongInLittleMemory, ()) {
  const Story story = draw_story<Kilobot>(12, 3, 40);
  const auto air = draw_air(story.by_sender, {true, true, false});
  TestNode<Kilobot> receiver(99);
  receiver.open(3);
  for (const InAir& in_air : air) {
    receiver.hear(in_air.packet);
    ++receiver.port.now;
  }
  std::set<Bytes> delivered;
  for (const auto& received : receiver.received) {
    RC_ASSERT(std::count(story.messages.begin(), story.messages.end(), received.bytes) == 1);
    RC_ASSERT(delivered.insert(received.bytes).second);
  }
}

/// A chain of forwarders, each waiting as long as it likes, across a wrap of the clock: the delay
/// is the sum of the waits, or the largest number when that does not fit.
template <class P>
void delay_adds_up(uint32_t channel, uint64_t max_wait) {
  using W = Wire<P>;
  uint64_t waited = 0;
  const auto hops = *rc::gen::inRange<uint32_t>(0, 6);
  TestNode<P> origin(1);
  origin.port.now = *rc::gen::arbitrary<uint32_t>();
  origin.open(channel, 8, true);
  RC_ASSERT(origin.publisher->send(pattern(1).data(), 1) == Error::kOk);
  const auto draw_wait = [&] {
    return *rc::gen::inRange<uint32_t>(0, static_cast<uint32_t>(max_wait));
  };
  uint32_t wait = draw_wait();
  origin.port.now += wait;
  waited += wait;
  Bytes packet = origin.pull();
  for (uint32_t hop = 0; hop < hops; ++hop) {
    auto forwarder = std::make_unique<TestNode<P>>(static_cast<uint16_t>(hop + 2));
    forwarder->port.now = *rc::gen::arbitrary<uint32_t>();
    forwarder->hear(packet);
    wait = draw_wait();
    forwarder->port.now += wait;
    waited += wait;
    packet = forwarder->pull();
    RC_ASSERT(!packet.empty());
  }
  auto receiver = std::make_unique<TestNode<P>>(uint16_t{77});
  receiver->open(channel, 8, true);
  receiver->hear(packet);
  RC_ASSERT(receiver->received.size() == 1u);
  RC_ASSERT(receiver->received[0].reception.has_delay);
  RC_ASSERT(receiver->received[0].reception.delay_ticks ==
            (waited < W::kTimestampMax ? waited : uint64_t{W::kTimestampMax}));
}
template <uint8_t kBits>
struct Timed : Kilobot {
  static constexpr uint8_t kTimestampBits = kBits;
};
RC_GTEST_PROP(Delay, AddsUpForEveryTimestampWidth, ()) {
  delay_adds_up<Timed<4>>(8, 12);
  delay_adds_up<Timed<8>>(8, 100);
  delay_adds_up<Timed<13>>(8, 4000);
  delay_adds_up<Kilobot>(8, 40000);
  delay_adds_up<Wifi>(500, 0x60000000);
}

/// A packet with any bytes changed is refused or understood, and the node goes on working.
RC_GTEST_PROP(Damage, NeverStopsANode, ()) {
  auto receiver = std::make_unique<TestNode<Wifi>>(uint16_t{9});
  receiver->open(3, 2, *rc::gen::arbitrary<bool>());
  const auto packets = *rc::gen::container<std::vector<Bytes>>(rc::gen::arbitrary<Bytes>());
  for (const Bytes& packet : packets) receiver->hear(packet);
  TestNode<Wifi> sender(1);
  sender.open(3, 2, false);
  sender.publisher->send(pattern(3).data(), 3);
  const size_t before = receiver->received.size();
  receiver->hear(sender.pull());
  RC_ASSERT(receiver->received.size() == before + 1);
}

}  // namespace
}  // namespace swarmtalk::core::testing
