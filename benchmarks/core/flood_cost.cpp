// Situations of receive_cost: packets that are sent on, their copies, and messages that come last
// packet first. "kilobot" in a name: the Kilobot's own memory; else memory for all.
#include <algorithm>
#include <cstdint>

#include "benchmarks/core/measured_node.hpp"

namespace swarmtalk::core::cost {
namespace {

struct Large : MemoryForAll {};  // local to this file

constexpr DistanceSensing kNear{50};
constexpr uint32_t kRounds = 16;  // as many as there are message numbers
template <class P>
std::vector<Round> rounds(uint32_t senders, uint32_t length, uint8_t ttl) {
  return rounds_of<P>(kRounds, senders, length * Wire<P>::kPayloadBytes, ttl);
}

/// One's own floods, with the time between packets that a Kilobot has.
template <class P, uint32_t kLength>
void own_flood(uint32_t packets) {
  Measured<P> measured(kFloodTtl);
  Swarmtalk<P>& node = *measured.node;
  Publisher<P>& publisher = *measured.publisher;
  uint8_t out[P::kMtuBytes];
  const uint8_t message[kLength * Wire<P>::kPayloadBytes] = {};
  for (; packets != 0; --packets, ticks += kSlotTicks) {
    if (publisher.available()) publisher.send(message, sizeof(message));
    node.pull_packet(out);
  }
}

/// Messages of one hop, the last packet first.
template <class P, uint32_t kLength>
void receive_reversed(uint32_t packets) {
  Measured<P> measured(0);
  Swarmtalk<P>& node = *measured.node;
  const std::vector<Round> all = rounds<P>(1, kLength, 0);
  for (uint32_t heard = 0, round = 0; heard < packets; ++round) {
    const Round& message = all[round % kRounds];
    for (uint32_t n = kLength; n-- != 0 && heard < packets; ++heard) hear(node, message[n], kNear);
    ticks += kLength * kSlotTicks;
  }
}

/// Floods of one packet, each received and sent on before the next.
/// @param kTicks  between two of them, whoever sends them
template <class P, uint32_t kSenders, uint32_t kTicks>
void flood(uint32_t packets) {
  Measured<P> measured(kFloodTtl);
  Swarmtalk<P>& node = *measured.node;
  uint8_t out[P::kMtuBytes];
  const std::vector<Round> all = rounds<P>(kSenders, 1, kFloodTtl);
  for (uint32_t heard = 0, round = 0; heard < packets; ++round) {
    for (const Packet& packet : all[round % kRounds]) {
      hear(node, packet, kNear);
      node.pull_packet(out);
      ticks += kTicks;
      if (++heard == packets) break;
    }
  }
}

constexpr uint32_t kOriginals = 200;  // messages, of which `packets` copies are heard
uint32_t copies_of(uint32_t original, uint32_t packets) {
  return packets * (original + 1) / kOriginals - packets * original / kOriginals;
}

/// Copies of floods of 20 senders that a neighbour has sent on, while one's own waits to be pulled
/// or after.
template <class P, bool kWaiting>
void hear_again(uint32_t packets) {
  constexpr uint32_t kSenders = 20;
  Measured<P> measured(kFloodTtl);
  Swarmtalk<P>& node = *measured.node;
  uint8_t out[P::kMtuBytes];
  const std::vector<Round> all = rounds<P>(kSenders, 1, kFloodTtl);
  for (uint32_t n = 0; n < kOriginals; ++n, ticks += kSlotTicks) {
    const Packet& original = all[n / kSenders % kRounds][n % kSenders];
    const Packet copy = one_hop_further<P>(original);
    hear(node, original, kNear);
    if (!kWaiting) node.pull_packet(out);
    for (uint32_t left = copies_of(n, packets); left != 0; --left) hear(node, copy, kNear);
    if (kWaiting) node.pull_packet(out);
  }
}

/// Copies of one's own floods that a neighbour has sent on.
template <class P>
void own_echo(uint32_t packets) {
  Measured<P> measured(kFloodTtl);
  Swarmtalk<P>& node = *measured.node;
  Publisher<P>& publisher = *measured.publisher;
  uint8_t out[P::kMtuBytes];
  const uint8_t message[Wire<P>::kPayloadBytes] = {};
  for (uint32_t n = 0; n < kOriginals; ++n, ticks += kSlotTicks) {
    publisher.send(message, sizeof(message));
    node.pull_packet(out);
    const Packet copy = one_hop_further<P>(Packet(out, out + P::kMtuBytes));
    for (uint32_t left = copies_of(n, packets); left != 0; --left) hear(node, copy, kNear);
  }
}

struct Situation {
  const char* name;
  void (*run)(uint32_t packets);
};
constexpr Situation kSituations[] = {
    {"reverse8", &receive_reversed<Large, 8>},
    {"kilobot_reverse8", &receive_reversed<Kilobot, 8>},
    {"flood1", &flood<Large, 1, kSlotTicks>},
    {"flood20", &flood<Large, 20, kSlotTicks>},
    {"kilobot_flood1", &flood<Kilobot, 1, kSlotTicks>},
    {"kilobot_flood20", &flood<Kilobot, 20, kSlotTicks>},
    {"again", &hear_again<Large, false>},
    {"again_waiting", &hear_again<Large, true>},
    {"kilobot_again", &hear_again<Kilobot, false>},
    {"kilobot_again_waiting", &hear_again<Kilobot, true>},
    {"own_flood1", &own_flood<Large, 1>},
    {"own_flood8", &own_flood<Large, 8>},
    {"kilobot_own_flood1", &own_flood<Kilobot, 1>},
    {"kilobot_own_flood8", &own_flood<Kilobot, 8>},
    {"own_echo", &own_echo<Large>},
    {"kilobot_own_echo", &own_echo<Kilobot>},
};

}  // namespace

bool run_flood(const std::string& situation, uint32_t packets) {
  for (const Situation& each : kSituations) {
    if (situation != each.name) continue;
    each.run(packets);
    return true;
  }
  return false;
}

}  // namespace swarmtalk::core::cost
