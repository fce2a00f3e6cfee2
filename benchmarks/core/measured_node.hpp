// What the situations of receive_cost.cpp share: a clock, a count of deliveries, packets made
// beforehand by real nodes, and the node that is measured.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::core::cost {

/// The paper's nine bytes with sum-8, and memory for thousands of packets.
struct MemoryForAll : Kilobot {
  static constexpr uint16_t kFragmentSlots = 4000;
  static constexpr uint16_t kRecords = 4096;
  static constexpr uint16_t kBuckets = 4096;
  static constexpr uint32_t kAssemblyTicks = 30000;
  static constexpr uint32_t kBufferBudgetBytes = 1u << 20;
};

inline uint32_t ticks = 1000;
inline uint64_t delivered = 0;
inline uint64_t random_state = 1;  // of splitmix64: a node may draw secrets from it

inline uint64_t next_random() {
  uint64_t z = (random_state += UINT64_C(0x9E3779B97F4A7C15));
  z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
  z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
  return z ^ (z >> 31);
}
inline Port port() {
  return Port{[](void*) { return ticks; },
              [](void*) { return static_cast<uint32_t>(next_random() >> 32); }, nullptr};
}

using Packet = std::vector<uint8_t>;
using Round = std::vector<Packet>;

constexpr unsigned kChannel = 0;  // the one that is measured
constexpr uint8_t kFloodTtl = 3;
constexpr uint32_t kSlotTicks = 16;  // between two packets of a Kilobot

/// The packets of one sender's next message.
template <class P>
std::vector<Packet> message_of(Swarmtalk<P>& node, Publisher<P>& publisher, uint32_t bytes) {
  const std::vector<uint8_t> message(bytes, static_cast<uint8_t>(node.node_id()));
  publisher.send(message.data(), static_cast<uint16_t>(bytes));
  std::vector<Packet> packets;
  while (node.has_packet()) {
    Packet packet(P::kMtuBytes);
    packet.resize(node.pull_packet(packet.data()));
    packets.push_back(packet);
  }
  return packets;
}

/// `count` rounds of packets: in each, every sender's next message of `bytes` bytes, the senders
/// interleaved packet by packet. Their ids are 1, 2, ...
template <class P>
std::vector<Round> rounds_of(uint32_t count, uint32_t senders, uint32_t bytes, uint8_t ttl) {
  std::vector<std::vector<std::vector<Packet>>> by_round(count);
  for (uint32_t sender = 0; sender < senders; ++sender) {
    auto node = std::make_unique<Swarmtalk<P>>(port());
    node->set_node_id(static_cast<typename Wire<P>::NodeId>(sender + 1));
    node->set_epoch(static_cast<uint16_t>(next_random()));
    auto* publisher = node->new_channel(kChannel, ttl, false)->new_publisher(nullptr, nullptr);
    for (auto& messages : by_round) messages.push_back(message_of(*node, *publisher, bytes));
  }
  std::vector<Round> rounds(count);
  for (uint32_t number = 0; number < count; ++number) {
    for (size_t n = 0; n < by_round[number][0].size(); ++n) {
      for (auto& message : by_round[number]) rounds[number].push_back(message[n]);
    }
  }
  return rounds;
}

/// The same packet as a neighbour sends it on.
template <class P>
Packet one_hop_further(Packet packet) {
  Wire<P>::count_hop(packet.data(), Wire<P>::decode(packet.data()));
  Wire<P>::seal(packet.data(),
                static_cast<typename Wire<P>::PacketSize>(packet.size() - Wire<P>::kChecksumBytes));
  return packet;
}

template <class P>
void hear(Swarmtalk<P>& node, const Packet& packet, const typename P::Sensing& sensing) {
  node.on_packet(packet.data(), P::kPadded ? P::kMtuBytes : static_cast<uint16_t>(packet.size()),
                 sensing);
}

// Situations of the other files. @return false if there is none of that name there
bool run_flood(const std::string& situation, uint32_t packets);
bool run_wifi(const std::string& situation, uint32_t packets);

/// The node that is measured, listening on kChannel, and its publisher there. Loops that are
/// counted take references to both first.
template <class P>
struct Measured {
  explicit Measured(uint8_t ttl) : node(std::make_unique<Swarmtalk<P>>(port())) {
    node->set_node_id(250);
    Channel<P>* const channel = node->new_channel(kChannel, ttl, false);
    publisher = channel->new_publisher(nullptr, nullptr);
    channel->new_subscriber(
        100, [](void*, const uint8_t*, uint16_t, const Reception<P>&) { ++delivered; }, nullptr);
  }
  std::unique_ptr<Swarmtalk<P>> node;
  Publisher<P>* publisher;
};

}  // namespace swarmtalk::core::cost
