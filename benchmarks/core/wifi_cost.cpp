// Situations of receive_cost in the wifi profile: messages of one packet with 64 bytes, in a table
// of records that is full of messages of the last minute, most of the time, or of an attacker's.
#include <cstdlib>
#include <limits>

#include "benchmarks/core/chosen_keys.hpp"
#include "benchmarks/core/measured_node.hpp"
#include "swarmtalk/profiles/wifi.hpp"

namespace swarmtalk::core::cost {
namespace {

constexpr uint32_t kMostPackets = 24000;  // measured at once; prepared whatever is measured
constexpr PoseSensing kUnknown{std::numeric_limits<float>::quiet_NaN(),
                               std::numeric_limits<float>::quiet_NaN(), 0};
constexpr uint32_t kSecond = 1000000;  // ticks
using Node = Swarmtalk<Wifi>;

/// Messages of `senders` in turn, enough for `before` and kMostPackets.
std::vector<Packet> messages(uint32_t senders, uint32_t before, uint8_t ttl) {
  std::vector<Packet> all;
  for (Round& round :
       rounds_of<Wifi>((before + kMostPackets) / senders + 1, senders, kWifiPayload, ttl)) {
    for (Packet& packet : round) all.push_back(std::move(packet));
  }
  return all;
}

/// Received, and sent on where they are floods.
template <bool kSentOn>
void receive_at(Node& node, const Packet* packets, uint32_t count, uint32_t step) {
  uint8_t out[Wifi::kMtuBytes];
  for (const Packet* const end = packets + count; packets != end; ++packets) {
    hear(node, *packets, kUnknown);
    if (kSentOn) node.pull_packet(out);
    ticks += step;
  }
}

/// @param kPerSecond  messages of all senders together
/// @param kBefore     of these before those that are measured
template <uint32_t kSenders, uint32_t kPerSecond, uint32_t kBefore, uint8_t kTtl>
void traffic(uint32_t packets) {
  const std::vector<Packet> all = messages(kSenders, kBefore, kTtl);
  Measured<Wifi> measured(kTtl);
  receive_at<(kTtl > 0)>(*measured.node, all.data(), kBefore, kSecond / kPerSecond);
  receive_at<(kTtl > 0)>(*measured.node, &all[kBefore], packets, kSecond / kPerSecond);
}

struct Situation {
  const char* name;
  void (*run)(uint32_t packets);
};
constexpr uint32_t kMinute = 6200;  // messages, at 100 a second
constexpr Situation kSituations[] = {
    {"wifi_calm", &traffic<10, 10, 5000, 0>},
    {"wifi_calm_flood", &traffic<10, 1, 5000, kFloodTtl>},
    {"wifi_full", &traffic<100, 100, kMinute, 0>},
    {"wifi_full_flood", &traffic<100, 100, kMinute, kFloodTtl>},
    {"wifi_fast", &traffic<1, 5000, 2 * Wifi::kRecords, 0>},
    {"wifi_fast_flood", &traffic<1, 5000, 2 * Wifi::kRecords, kFloodTtl>},
};

/// As many messages as there are records, by chosen names, and then more of them.
/// @param ttl  of the channel: records of floods are kept longer
bool chosen(const std::string& kind, uint8_t ttl, uint32_t packets) {
  std::vector<Packet> all;
  for (const Name& name : chosen_names(kind, Wifi::kRecords + kMostPackets)) {
    all.push_back(packet_of(name));
  }
  if (all.empty()) return false;
  Measured<Wifi> measured(ttl);
  receive_at<false>(*measured.node, all.data(), Wifi::kRecords, kSecond / 5000);
  receive_at<false>(*measured.node, &all[Wifi::kRecords], packets, kSecond / 5000);
  return true;
}

}  // namespace

bool run_wifi(const std::string& situation, uint32_t packets) {
  if (packets > kMostPackets) return false;
  for (const Situation& each : kSituations) {
    if (situation != each.name) continue;
    each.run(packets);
    return true;
  }
  const std::string one_hop = "wifi_chosen_";
  const std::string flood = "wifi_chosen_flood_";
  if (situation.rfind(flood, 0) == 0) {
    return chosen(situation.substr(flood.size()), kFloodTtl, packets);
  }
  return situation.rfind(one_hop, 0) == 0 && chosen(situation.substr(one_hop.size()), 0, packets);
}

}  // namespace swarmtalk::core::cost
