// What the library does, as one number per profile, to be compared between compilers, levels of
// optimisation and processors: two nodes talk over a bad link for some thousand steps drawn from a
// seed, and everything that comes out of them is hashed. Before that, packets known from elsewhere.
//
// Prints lines "NAME HASH". On AVR the same characters go to GPIOR2 (see avr_console.cpp), and only
// the profiles that fit its memory run.
#include <stdint.h>
#include <string.h>

#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/swarmtalk.hpp"
#ifdef __AVR__
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#else
#include <stdio.h>

#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#endif

namespace {

using namespace swarmtalk::core;

void put(char letter) {
#ifdef __AVR__
  GPIOR2 = static_cast<uint8_t>(letter);
#else
  putchar(letter);
#endif
}
void print(const char* name, uint32_t hash) {
  while (*name != '\0') put(*name++);
  put(' ');
  for (uint8_t i = 0; i < 8; ++i, hash <<= 4) put("0123456789abcdef"[hash >> 28]);
  put('\n');
}

uint32_t ticks = 0;
uint32_t seed = 1;
uint32_t draw() {
  seed = seed * UINT32_C(1664525) + UINT32_C(1013904223);
  return seed >> 8;
}
uint32_t hash = 0;
void add_to_hash(const void* bytes, uint16_t size) {
  for (uint16_t i = 0; i < size; ++i) {
    hash = (hash ^ static_cast<const uint8_t*>(bytes)[i]) * UINT32_C(16777619);
  }
}
void add_to_hash(uint32_t number) {
  for (uint8_t i = 0; i < 4; ++i, number >>= 8) {
    const uint8_t byte = static_cast<uint8_t>(number);
    add_to_hash(&byte, 1);
  }
}

template <class P>
class Pair {
 public:
  Pair() : a_(port()), b_(port()) {
    a_.set_node_id(1);
    b_.set_node_id(2);
    open(a_, 0);
    open(b_, 1);
  }

  void run() {
    for (uint16_t step = 0; step < 3000; ++step) {
      const uint32_t what = draw();
      switch (what % 8) {
        case 0:
          ticks += what >> 3 & (P::kClockBits == 32 ? UINT32_C(0xFFFF) : 15u);
          break;
        case 1:
        case 2:
          publish(static_cast<uint8_t>(what >> 3 & 3));
          break;
        case 3:
          carry(b_, a_);
          break;
        default:
          carry(a_, b_);
          break;
      }
    }
    add_to_hash(static_cast<uint32_t>(a_.counters().packets_sent));
    add_to_hash(static_cast<uint32_t>(b_.counters().messages_received));
    add_to_hash(static_cast<uint32_t>(b_.counters().duplicates));
    add_to_hash(static_cast<uint32_t>(b_.counters().no_memory));
    add_to_hash(static_cast<uint32_t>(b_.counters().bad_checksums));
    add_to_hash(static_cast<uint32_t>(b_.counters().aged_out));
  }

 private:
  static Port port() {
    return Port{[](void*) { return ticks; }, [](void*) { return draw(); }, nullptr};
  }
  static void on_message(void*, const uint8_t* bytes, uint16_t size, const Reception<P>& heard) {
    add_to_hash(bytes, size);
    add_to_hash(heard.message);
    add_to_hash(heard.ttl);
    add_to_hash(heard.hops);
    add_to_hash(heard.has_delay ? heard.delay_ticks : 0);
  }
  void open(Swarmtalk<P>& node, uint8_t side) {
    constexpr bool kFree = P::kTimestampedFrom == kNoTimestampedChannels;
    Channel<P>* plain = node.new_channel(3, 2, false);
    Channel<P>* timed = node.new_channel(kFree ? 2 : 9, 0, true);
    publishers_[side][0] = plain->new_publisher(nullptr, nullptr);
    publishers_[side][1] = timed->new_publisher(nullptr, nullptr);
    plain->new_subscriber(100, &on_message, nullptr);
    timed->new_subscriber(100, &on_message, nullptr);
  }
  void publish(uint8_t which) {
    uint8_t message[Wire<P>::kMessageBytes < 3000 ? Wire<P>::kMessageBytes : 3000];
    const uint16_t limit = (which & 1) != 0 && Wire<P>::kTimedMessageBytes < sizeof message
                               ? Wire<P>::kTimedMessageBytes
                               : static_cast<uint16_t>(sizeof message);
    const uint16_t size = static_cast<uint16_t>(1 + draw() % limit);
    for (uint16_t i = 0; i < size; ++i) message[i] = static_cast<uint8_t>(draw());
    add_to_hash(static_cast<uint32_t>(publishers_[which >> 1][which & 1]->send(message, size)));
  }
  /// One packet over the link: lost, damaged or doubled now and then.
  void carry(Swarmtalk<P>& from, Swarmtalk<P>& to) {
    uint8_t packet[P::kMtuBytes];
    const uint16_t size = from.pull_packet(packet);
    if (size == 0) return;
    add_to_hash(packet, size);
    const uint32_t luck = draw() % 16;
    if (luck == 0) return;
    if (luck == 1) packet[draw() % size] ^= 0x10;
    typename P::Sensing sensing = typename P::Sensing();
    to.on_packet(packet, size, sensing);
    if (luck == 2) to.on_packet(packet, size, sensing);
  }

  Swarmtalk<P> a_;
  Swarmtalk<P> b_;
  Publisher<P>* publishers_[2][2];
};

template <class P>
__attribute__((noinline)) void run(const char* name, uint32_t clock_start) {
  ticks = clock_start;
  seed = 1;
  hash = UINT32_C(2166136261);
#ifdef __AVR__  // one pair after the other fits its memory
  Pair<P> pair;
#else
  static Pair<P> pair;
#endif
  pair.run();
  print(name, hash);
}

/// The wire's examples, and the checksum that is not their sum.
bool knows_the_vectors() {
  const uint8_t kilobot[9] = {0x07, 0x10, 0xF2, 0x61, 0x62, 0x63, 0x18, 0x02, 0x49};
  const uint8_t classic[8] = {0xA5, 0x91, 0x27, 0x11, 0x22, 0x33, 0x00, 0x00};
  const Wire<Kilobot>::Header k = Wire<Kilobot>::decode(kilobot);
  const Wire<Classic2020>::Header c = Wire<Classic2020>::decode(classic);
  uint8_t again[8];
  Wire<Classic2020>::encode(c, again);
  return Wire<Kilobot>::check(kilobot, 9) == Error::kOk && k.node == 7 && k.message == 1 &&
         k.channel == 15 && k.ttl == 2 && Wire<Kilobot>::is_timestamped(kilobot) && !k.end &&
         Wire<Kilobot>::timestamp(kilobot + 3, 5) == 536 && c.node == 165 && c.message == 9 &&
         c.end && c.channel == 2 && c.ttl == 7 && memcmp(again, classic, 3) == 0 &&
         crc8(classic, 8) == 0xD9;
}

/// Small enough for two nodes of each in an ATmega328P.
struct SmallKilobot : Kilobot {
  static constexpr uint16_t kFragmentSlots = 12;
  static constexpr uint16_t kForwardSlots = 4;
  static constexpr uint16_t kRecords = 8;
};
struct SmallClassic : Classic2020 {
  static constexpr uint16_t kFragmentSlots = 12;
  static constexpr uint16_t kForwardSlots = 4;
  static constexpr uint16_t kRecords = 8;
};

/// No field as wide as any other profile's, and every field there is.
struct Odd : ProfileDefaults {
  using Sensing = DistanceSensing;
  static constexpr uint16_t kMtuBytes = 14;
  static constexpr uint8_t kNodeBits = 10;
  static constexpr uint8_t kMessageBits = 5;
  static constexpr uint8_t kSequenceBits = 6;
  static constexpr uint8_t kChannelBits = 3;
  static constexpr uint8_t kTtlBits = 6;
  static constexpr uint8_t kHopsBits = 3;
  static constexpr uint8_t kSizeBits = 7;
  static constexpr uint8_t kEpochBits = 3;
  static constexpr uint8_t kTimestampedBits = 1;
  static constexpr uint8_t kTimestampBits = 13;
  static constexpr Checksum kChecksum = Checksum::kCrc8;
  static constexpr bool kPadded = false;
  static constexpr uint32_t kMaxMessageBytes = 50;
  static constexpr uint16_t kFragmentSlots = 7;
  static constexpr uint16_t kForwardSlots = 3;
  static constexpr uint16_t kRecords = 5;
};

}  // namespace

int main() {
  print("vectors", knows_the_vectors() ? 1 : 0);
  run<SmallKilobot>("kilobot", 65000);
  run<SmallClassic>("classic2020", UINT32_C(4294960000));
  run<Odd>("odd", 65000);
#ifdef __AVR__
  cli();
  sleep_mode();  // ends the emulation
#else
  run<Footbot>("footbot", 65000);
  run<Wifi>("wifi", UINT32_C(4294000000));
#endif
  return 0;
}
