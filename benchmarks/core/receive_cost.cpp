// Work for callgrind: receives `packets` packets in one of several situations, built beforehand, so
// that the difference between two run lengths is the cost of receiving alone.
//   receive_cost SITUATION[:SEED] PACKETS     prints how many messages were delivered
// Situations are said in core_table.py.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "benchmarks/core/chosen_keys.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace {

using namespace swarmtalk::core;
using namespace swarmtalk::core::cost;

/// The paper's nine bytes with sum-8, and memory for thousands of packets.
struct MemoryForAll : Kilobot {
  static constexpr uint16_t kFragmentSlots = 4000;
  static constexpr uint16_t kRecords = 4096;
  static constexpr uint16_t kBuckets = 4096;
  static constexpr uint32_t kAssemblyTicks = 30000;
  static constexpr uint32_t kBufferBudgetBytes = 1u << 20;
};

constexpr uint8_t kFloodTtl = 3;
constexpr uint32_t kSecond = 1000000;     // ticks of the wifi profile
constexpr uint32_t kMostPackets = 24000;  // measured at once; prepared whatever is measured
constexpr DistanceSensing kNear{50};
constexpr PoseSensing kUnknown{std::numeric_limits<float>::quiet_NaN(),
                               std::numeric_limits<float>::quiet_NaN(), 0};

uint32_t ticks = 1000;
uint64_t delivered = 0;
uint64_t random_state = 1;  // of splitmix64: a node draws its secret from it

uint64_t next_random() {
  uint64_t z = (random_state += UINT64_C(0x9E3779B97F4A7C15));
  z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
  z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
  return z ^ (z >> 31);
}
Port port() {
  return Port{[](void*) { return ticks; },
              [](void*) { return static_cast<uint32_t>(next_random() >> 32); }, nullptr};
}

/// The node that is measured, listening on kChannel.
template <class P>
std::unique_ptr<Swarmtalk<P>> listener(uint8_t ttl) {
  auto node = std::make_unique<Swarmtalk<P>>(port());
  node->set_node_id(250);
  node->new_channel(kChannel, ttl, false)
      ->new_subscriber(
          100, [](void*, const uint8_t*, uint16_t, const Reception<P>&) { ++delivered; }, nullptr);
  return node;
}

/// `messages` of `bytes` bytes each, of every one of `senders` nodes 1, 2, ...: in turn, the first
/// of all first, and packet by packet where they have several.
template <class P>
std::vector<Packet> packets_of(uint32_t messages, uint32_t senders, uint32_t bytes, uint8_t ttl) {
  std::vector<std::vector<Packet>> by_sender(senders);
  for (uint32_t sender = 0; sender < senders; ++sender) {
    auto node = std::make_unique<Swarmtalk<P>>(port());
    node->set_node_id(static_cast<typename Wire<P>::NodeId>(sender + 1));
    node->set_epoch(static_cast<uint16_t>(next_random()));
    auto* publisher = node->new_channel(kChannel, ttl, false)->new_publisher(nullptr, nullptr);
    const std::vector<uint8_t> message(bytes, static_cast<uint8_t>(sender));
    for (uint32_t n = 0; n < messages; ++n) {
      publisher->send(message.data(), static_cast<uint16_t>(bytes));
      while (node->has_packet()) {
        Packet packet(P::kMtuBytes);
        packet.resize(node->pull_packet(packet.data()));
        by_sender[sender].push_back(packet);
      }
    }
  }
  std::vector<Packet> all;
  for (size_t n = 0; n < by_sender[0].size(); ++n) {
    for (const auto& packets : by_sender) all.push_back(packets[n]);
  }
  return all;
}

/// Leaves `count` first packets of messages that never go on, from other senders.
void fill(Swarmtalk<MemoryForAll>& node, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t sender = 120 + i / 16 % 100;
    const uint32_t sequence = i / 1600;
    uint8_t packet[9] = {static_cast<uint8_t>(sender),
                         static_cast<uint8_t>((i % 16) << 4 | sequence << 1)};
    Wire<MemoryForAll>::seal(packet, 8);
    node.on_packet(packet, 9, kNear);
  }
}

/// Messages of `length` packets of one hop, from `senders` in turn, while `held` packets of others
/// are kept.
void receive_small(uint32_t packets, uint32_t senders, uint32_t length, uint32_t held) {
  const auto node = listener<MemoryForAll>(0);
  fill(*node, held);
  const std::vector<Packet> all =
      packets_of<MemoryForAll>(16, senders, length * Wire<MemoryForAll>::kPayloadBytes, 0);
  for (uint32_t n = 0; n < packets; ++n) {
    node->on_packet(all[n % all.size()].data(), 9, kNear);
    if (n % (senders * length) == 0) ticks += 16 * length;
  }
}

/// In a table of the wifi profile that is full of messages of the last minute. Floods are sent on.
void receive_wifi(const std::vector<Packet>& all, uint32_t before, uint32_t packets, uint8_t ttl,
                  uint32_t step) {
  const auto node = listener<Wifi>(ttl);
  uint8_t out[Wifi::kMtuBytes];
  for (uint32_t n = 0; n < before + packets; ++n, ticks += step) {
    node->on_packet(all[n].data(), static_cast<uint16_t>(all[n].size()), kUnknown);
    node->pull_packet(out);
  }
}

void full(uint32_t packets, uint8_t ttl) {
  constexpr uint32_t kSenders = 100;
  constexpr uint32_t kBefore = 6200;  // a minute, at 100 a second
  const auto all =
      packets_of<Wifi>((kBefore + kMostPackets) / kSenders + 1, kSenders, kWifiPayload, ttl);
  receive_wifi(all, kBefore, packets, ttl, kSecond / 100);
}

/// As many messages as there are records, by chosen names, and then more of them.
bool chosen(const std::string& kind, uint32_t packets, uint8_t ttl) {
  std::vector<Packet> all;
  for (const Name& name : chosen_names(kind, Wifi::kRecords + kMostPackets)) {
    all.push_back(packet_of(name));
  }
  if (all.empty()) return false;
  receive_wifi(all, Wifi::kRecords, packets, ttl, kSecond / 5000);
  return true;
}

bool run(const std::string& situation, uint32_t packets) {
  const std::string one_hop = "wifi_chosen_";
  const std::string flood = "wifi_chosen_flood_";
  if (situation == "single") {
    receive_small(packets, 1, 1, 0);
  } else if (situation == "full3000") {
    receive_small(packets, 1, 1, 3000);
  } else if (situation == "senders2") {
    receive_small(packets, 2, 8, 0);
  } else if (situation == "senders100") {
    receive_small(packets, 100, 8, 0);
  } else if (situation == "wifi_full") {
    full(packets, 0);
  } else if (situation == "wifi_full_flood") {
    full(packets, kFloodTtl);
  } else if (situation.rfind(flood, 0) == 0) {
    return chosen(situation.substr(flood.size()), packets, kFloodTtl);
  } else {
    return situation.rfind(one_hop, 0) == 0 && chosen(situation.substr(one_hop.size()), packets, 0);
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  std::string situation = argv[1];
  const size_t colon = situation.find(':');
  if (colon != std::string::npos) {
    random_state = std::strtoull(&situation[colon + 1], nullptr, 10);
    situation.resize(colon);
  }
  const auto packets = static_cast<uint32_t>(std::atoi(argv[2]));
  if (packets > kMostPackets || !run(situation, packets)) return 2;
  std::printf("%llu\n", static_cast<unsigned long long>(delivered));
  return 0;
}
