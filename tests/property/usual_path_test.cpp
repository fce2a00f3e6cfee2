// Two nodes that differ in one thing, whether they take the short ways (the usual path first, and
// summaries of chains where the other one walks along them), live through the same random story:
// loss, copies, reordering, damage, floods, timestamps, memory too small, clocks that jump,
// channels that come and go. They must not differ in anything that can be seen.
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core::testing {
namespace {

template <class Base, bool kFirst>
struct Path : Base {
  static constexpr bool kUsualPathFirst = kFirst;
  static constexpr bool kChainSummaries = kFirst;
};

/// Few chains, so that messages share them.
struct Crowded : Kilobot {
  static constexpr uint16_t kBuckets = 4;
  static constexpr uint16_t kRecords = 16;
  static constexpr uint16_t kFragmentSlots = 20;
  static constexpr uint16_t kChannels = 4;
};
struct Roomy : Crowded {
  static constexpr uint16_t kBuckets = 256;
  static constexpr uint16_t kRecords = 400;
  static constexpr uint16_t kFragmentSlots = 600;
  static constexpr uint32_t kBufferBudgetBytes = 16384;
};
struct SmallFootbot : Footbot {
  static constexpr uint16_t kBuckets = 8;
  static constexpr uint16_t kRecords = 40;
  static constexpr uint16_t kFragmentSlots = 30;
};
/// Two subscribers of each channel.
struct TwoSubscribers : Kilobot {
  static constexpr uint16_t kBuckets = 8;
  static constexpr uint8_t kSubscribers = 2;
  static constexpr uint16_t kChannels = 4;
};
struct SmallWifi : Wifi {
  static constexpr uint16_t kMtuBytes = 64;
  static constexpr uint16_t kBuckets = 16;
  static constexpr uint16_t kRecords = 24;
  static constexpr uint16_t kFragmentSlots = 24;
  static constexpr uint32_t kMaxMessageBytes = 300;
  static constexpr uint32_t kAssemblyTicks = 100;
  static constexpr uint32_t kOneHopDuplicateTicks = 30;
  static constexpr uint32_t kFloodSurelyTicks = 200;
  static constexpr uint32_t kFloodTicks = 400;
};

constexpr uint32_t kSenders = 6;
/// Plain and flooded, timestamped and not; the last one is not registered at the receivers. 19
/// shares its low bits with 3 where numbers are wide.
struct OnAir {
  uint32_t id;
  uint8_t ttl;
  bool timestamped;
};

template <class P>
std::vector<OnAir> channels() {
  if (P::kChannelBits <= 4) return {{3, 0, false}, {9, 0, true}, {4, 2, false}, {5, 0, false}};
  return {{3, 0, false}, {9, 0, true}, {19, 2, true}, {5, 0, false}};
}

/// Senders whose packets wait in the air.
template <class P>
class Senders {
 public:
  Senders() {
    for (uint32_t i = 0; i < kSenders; ++i) {
      nodes_.push_back(std::make_unique<TestNode<P>>(static_cast<uint16_t>(10 + i)));
      publishers_.emplace_back();
      for (const OnAir& channel : channels<P>()) {
        nodes_[i]->open(channel.id, channel.ttl, channel.timestamped);
        publishers_[i].push_back(nodes_[i]->publisher);
      }
    }
  }
  void send(uint32_t sender, size_t channel, size_t bytes, uint32_t now) {
    nodes_[sender]->port.now = now;
    const OnAir on_air = channels<P>()[channel];
    const size_t limit = on_air.timestamped ? Wire<P>::kTimedMessageBytes : Wire<P>::kMessageBytes;
    const Bytes message = pattern(1 + bytes % limit, static_cast<uint8_t>(now + sender));
    EXPECT_EQ(
        publishers_[sender][channel]->send(message.data(), static_cast<uint16_t>(message.size())),
        Error::kOk);
    for (const Bytes& packet : nodes_[sender]->pull_all()) air.push_back(packet);
  }
  std::vector<Bytes> air;

 private:
  std::vector<std::unique_ptr<TestNode<P>>> nodes_;
  std::vector<std::vector<Publisher<P>*>> publishers_;
};

template <class P>
class Receiver : public TestNode<P> {
 public:
  Receiver() : TestNode<P>(200) {
    for (size_t i = 0; i + 1 < channels<P>().size(); ++i) reopen(i);
  }
  void reopen(size_t i) {
    const OnAir channel = channels<P>()[i];
    if (open_[i] != nullptr) this->node.remove_channel(open_[i]);
    open_[i] = nullptr;
    this->publisher = nullptr;
    if (reopened_++ % 4 != 3) open_[i] = this->open(channel.id, channel.ttl, channel.timestamped);
  }

 private:
  Channel<P>* open_[4] = {};
  uint32_t reopened_ = 0;
};

template <class A, class B>
void expect_same(const Received<A>& a, const Received<B>& b) {
  EXPECT_EQ(a.bytes, b.bytes);
  const Reception<A>& x = a.reception;
  const Reception<B>& y = b.reception;
  EXPECT_EQ(x.node, y.node);
  EXPECT_EQ(x.message, y.message);
  EXPECT_EQ(x.sequence, y.sequence);
  EXPECT_EQ(x.end, y.end);
  EXPECT_EQ(x.channel, y.channel);
  EXPECT_EQ(x.ttl, y.ttl);
  EXPECT_EQ(x.hops, y.hops);
  EXPECT_EQ(x.size, y.size);
  EXPECT_EQ(x.epoch, y.epoch);
  EXPECT_EQ(x.has_delay, y.has_delay);
  EXPECT_EQ(x.crossed_gateway, y.crossed_gateway);
  EXPECT_EQ(x.delay_ticks, y.delay_ticks);
  EXPECT_EQ(memcmp(&x.sensing, &y.sensing, sizeof(x.sensing)), 0);
}

template <class Sensing>
Sensing sensed(bool far) {
  Sensing sensing;
  memset(static_cast<void*>(&sensing), 0, sizeof(sensing));
  const typename Sensing::Distance distance = far ? 100 : 40;
  memcpy(static_cast<void*>(&sensing), &distance, sizeof(distance));  // the first member of all
  return sensing;
}

template <class Base>
class Twins {
 public:
  using First = Path<Base, true>;
  using General = Path<Base, false>;

  explicit Twins(uint32_t seed) : random_(seed) {}

  void live(uint32_t steps) {
    for (uint32_t step = 0; step < steps && !::testing::Test::HasFailure(); ++step) {
      if (below(3) == 0) senders_.send(below(kSenders), below(4), random_(), now_);
      if (below(4) == 0) now_ += below(20) == 0 ? below(600) : below(12);
      hear();
      if (below(5) == 0) pull();
      if (below(200) == 0) reopen();
      expect_same_counters();
    }
    ASSERT_EQ(first_->received.size(), general_->received.size());
    for (size_t i = 0; i < first_->received.size(); ++i) {
      expect_same(first_->received[i], general_->received[i]);
    }
    EXPECT_GT(first_->received.size(), steps / 50);
  }

 private:
  uint32_t below(uint32_t limit) { return static_cast<uint32_t>(random_() % limit); }
  void flip_bit(uint8_t& byte) { byte = static_cast<uint8_t>(byte ^ 1u << below(8)); }

  /// A packet from the air, mostly the oldest, sometimes damaged, kept for a copy, or made up.
  Bytes next_packet() {
    auto& air = senders_.air;
    const size_t at = below(10) == 0 ? below(static_cast<uint32_t>(air.size())) : 0;
    Bytes packet = air[at];
    if (below(10) != 0) air.erase(air.begin() + static_cast<std::ptrdiff_t>(at));
    if (below(40) == 0) flip_bit(packet[below(static_cast<uint32_t>(packet.size()))]);
    if (below(60) == 0) packet.resize(below(static_cast<uint32_t>(packet.size()) + 1));
    if (below(20) == 0 && packet.size() > Wire<Base>::kHeaderBytes + 1u) {  // made up, but sound
      flip_bit(packet[below(Wire<Base>::kHeaderBytes)]);
      Wire<Base>::seal(packet.data(), static_cast<typename Wire<Base>::PacketSize>(
                                          packet.size() - Wire<Base>::kChecksumBytes));
    }
    return packet;
  }
  void hear() {
    if (senders_.air.empty() || below(8) == 0) return;
    const Bytes packet = next_packet();
    first_->port.now = general_->port.now = now_;
    const auto sensing = sensed<typename Base::Sensing>(below(20) == 0);
    EXPECT_EQ(first_->hear(packet, sensing), general_->hear(packet, sensing));
  }
  void pull() {
    first_->port.now = general_->port.now = now_;
    if (below(10) == 0 && first_->publisher != nullptr && general_->publisher != nullptr) {
      const Bytes own = pattern(3);
      EXPECT_EQ(first_->publisher->send(own.data(), 3), general_->publisher->send(own.data(), 3));
    }
    const Bytes packet = first_->pull();
    EXPECT_EQ(packet, general_->pull());
    if (!packet.empty() && below(4) == 0) senders_.air.push_back(packet);  // an echo
  }
  void reopen() {
    const size_t channel = below(3);
    first_->reopen(channel);
    general_->reopen(channel);
  }
  /// Records that are over are all alike: the one that a new message gets may be another one, and
  /// an open one among the rest is given up some calls sooner or later.
  void expect_same_counters() {
    Counters<First> first = first_->node.counters();
    Counters<General> general = general_->node.counters();
    EXPECT_NEAR(static_cast<double>(first.aged_out), static_cast<double>(general.aged_out), 8);
    general.aged_out = first.aged_out;
    EXPECT_EQ(memcmp(&first, &general, sizeof(first)), 0);
    EXPECT_EQ(first_->received.size(), general_->received.size());
  }

  std::mt19937 random_;
  uint32_t now_ = 0xFFFFFF00;  // wraps soon
  Senders<Base> senders_;
  std::unique_ptr<Receiver<First>> first_ = std::make_unique<Receiver<First>>();
  std::unique_ptr<Receiver<General>> general_ = std::make_unique<Receiver<General>>();
};

template <class Base>
void live_alike() {
  for (uint32_t seed = 1; seed <= 20 && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    Twins<Base>(seed).live(3000);
  }
}

TEST(UsualPath, ChangesNothingWithRoomForAll) {
  live_alike<Roomy>();
}
TEST(UsualPath, ChangesNothingWhereMemoryIsShort) {
  live_alike<Crowded>();
}
TEST(UsualPath, ChangesNothingOnTheFootbot) {
  live_alike<SmallFootbot>();
}
TEST(UsualPath, ChangesNothingWithTwoSubscribers) {
  live_alike<TwoSubscribers>();
}
TEST(UsualPath, ChangesNothingOnWifi) {
  live_alike<SmallWifi>();
}

}  // namespace
}  // namespace swarmtalk::core::testing
