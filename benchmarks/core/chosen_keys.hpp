// Packets for the wifi profile whose messages' names are chosen to meet in a node's table of
// records. They attack by what anybody knows or can try at home: the multiplier that the table had
// for everybody until it was made a secret, names that follow each other in one field, and names
// that lie badly under most multipliers. A table with another hash that is not secret needs an
// attack of its own here.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "swarmtalk/profiles/wifi.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::core::cost {

constexpr uint16_t kWifiPayload = 64;
constexpr unsigned kChannel = 0;  // the one that is measured

using Packet = std::vector<uint8_t>;

struct Name {
  uint16_t node;
  uint32_t message;
  uint16_t epoch;
};

/// The `i`th name of a message whose product with the old multiplier begins with the same 12 bits.
inline Name under_the_old_multiplier(uint32_t i) {
  constexpr uint64_t kMultiplier = UINT64_C(0x9E3779B97F4A7C15);
  uint64_t inverse = kMultiplier;  // modulo 2^64, by Newton's steps, each doubling the right bits
  for (int step = 0; step < 5; ++step) inverse *= 2 - kMultiplier * inverse;
  // The last 16 bits of the product are 0 because those of the name, the channel's, are.
  const uint64_t product = (UINT64_C(0x5A5) << 52) | (static_cast<uint64_t>(i + 1) << 20);
  const uint64_t bits = product * inverse;  // node, message, channel 0; the epoch adds nothing
  return {static_cast<uint16_t>(bits >> 48), static_cast<uint32_t>(bits >> 16), 0};
}

/// Names a constant step apart, and of many steps the one under which a table of 4096 has the
/// longest chains for most of some multipliers: what an attacker can find out who does not know
/// which one is used.
class BadStep {
 public:
  BadStep() {
    uint64_t state = 7;
    const auto next = [&state] {  // xorshift64
      state ^= state << 13;
      state ^= state >> 7;
      return state ^= state << 17;
    };
    std::array<uint64_t, 12> multipliers;
    for (uint64_t& multiplier : multipliers) multiplier = next() | 1;
    uint64_t worst = 0;
    for (int candidate = 0; candidate < 48; ++candidate) {
      const uint64_t step = (next() >> (candidate % 48)) << 16;
      uint64_t longest = 0;
      for (const uint64_t multiplier : multipliers) longest += longest_chain(step, multiplier);
      if (longest <= worst) continue;
      worst = longest;
      step_ = step;
    }
  }
  Name name(uint32_t i) const {
    const uint64_t bits = (i + 1) * step_;
    return {static_cast<uint16_t>(bits >> 48), static_cast<uint32_t>(bits >> 16), 0};
  }

 private:
  static uint32_t longest_chain(uint64_t step, uint64_t multiplier) {
    std::array<uint16_t, 4096> chains{};
    uint32_t longest = 0;
    const uint64_t product_step = step * multiplier;
    uint64_t product = 0;
    for (int i = 0; i < 4096; ++i) {
      const uint32_t length = ++chains[(product += product_step) >> 52];
      if (length > longest) longest = length;
    }
    return longest;
  }
  uint64_t step_ = 1 << 16;
};

/// @return `count` names of the kind, all different; none if there is no such kind
inline std::vector<Name> chosen_names(const std::string& kind, uint32_t count) {
  std::vector<Name> names;
  const BadStep bad_step;
  for (uint32_t i = 0; i < count; ++i) {
    const auto low = static_cast<uint16_t>(i);
    uint32_t reversed = 0;
    for (uint32_t bit = 0; bit < 32; ++bit) reversed |= ((i >> bit) & 1) << (31 - bit);
    Name name{1, 1, 1};
    if (kind == "old") {
      name = under_the_old_multiplier(i);
    } else if (kind == "nodes") {
      name.node = low;
    } else if (kind == "numbers") {
      name.message = i;
    } else if (kind == "far_numbers") {  // the highest bits change first
      name.message = reversed;
    } else if (kind == "epochs") {
      name.epoch = low;
    } else if (kind == "nodes_epochs") {  // two fields that cancel where one is laid over the other
      name.node = low;
      name.epoch = static_cast<uint16_t>(low ^ 0x5A5A);
    } else if (kind == "step") {
      name = bad_step.name(i);
    } else {
      return {};
    }
    names.push_back(name);
  }
  return names;
}

/// A whole message of one packet.
inline Packet packet_of(const Name& name) {
  using W = Wire<Wifi>;
  W::Header header{};
  header.node = name.node;
  header.message = name.message;
  header.end = true;
  header.channel = kChannel;
  header.size = kWifiPayload;
  header.epoch = name.epoch;
  Packet packet(W::kHeaderBytes + kWifiPayload);
  W::encode(header, packet.data());
  return packet;
}

}  // namespace swarmtalk::core::cost
