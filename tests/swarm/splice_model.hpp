// How many spliced deliveries random ids should cause, worked out without the core: the birthday
// problem among robots that share a listener, times what one such pair of twins costs a listener.
//
// - Two robots out of each other's range draw the same of 255 ids with probability 1/255 and never
//   learn of it. Within range the second hears the first before it draws, unless that packet is
//   lost (probability p); then the first packet that is not ends it, and only the message begun
//   meanwhile, the first of each, goes out under one id.
// - A listener of both keeps packets by message number (16 of them). The twins count from numbers
//   that each has drawn and send at one pace, so their numbers stay as far apart. It gives up on
//   two packets for one place, and delivers a splice when the packets of one fall into the gaps of
//   the other. `TwinListener` plays that for one listener, with the medium's slots and loss.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <random>

#include "tests/swarm/one_hop.hpp"

namespace swarmtalk::core::testing {

/// One listener and two senders with one id, by the rules that docs/decisions/0012 states.
class TwinListener {
 public:
  TwinListener(uint32_t packets, double loss, uint64_t seed)
      : packets_(packets), loss_(loss), random_(seed) {}

  /// @param messages  of each twin; more than any run has: until the end
  /// @return splices delivered in `seconds`
  uint32_t splices(double seconds, uint32_t messages) {
    open_.clear();
    closed_us_.clear();
    uint32_t spliced = 0;
    double next_us[2] = {uniform() * kSlotUs, uniform() * kSlotUs};
    uint32_t sent[2] = {0, 0};  // packets
    for (uint32_t& first : first_) first = static_cast<uint32_t>(uniform() * 16);
    for (;;) {
      const int sender = next_us[0] <= next_us[1] ? 0 : 1;
      const double now_us = next_us[sender];
      if (now_us > seconds * 1e6 || sent[sender] / packets_ >= messages) return spliced;
      const uint32_t packet = sent[sender]++;
      if (uniform() >= loss_) spliced += hear(sender, packet, now_us);
      next_us[sender] += kSlotUs * (0.9 + 0.2 * uniform());
    }
  }

 private:
  static constexpr double kSlotUs = 500'000;
  static constexpr double kTickUs = 32'000;
  struct Open {
    std::map<uint32_t, int> senders;  // by place in the message
    double last_us = 0;
  };

  double uniform() { return std::uniform_real_distribution<double>()(random_); }

  uint32_t hear(int sender, uint32_t packet, double now_us) {
    const uint32_t number = (packet / packets_ + first_[sender]) % 16;
    const uint32_t place = packet % packets_;
    auto closed = closed_us_.find(number);
    if (closed != closed_us_.end() &&
        now_us - closed->second <= RoomForAll::kOneHopDuplicateTicks * kTickUs) {
      return 0;
    }
    Open& message = open_[number];
    if (now_us - message.last_us > RoomForAll::kAssemblyTicks * kTickUs) message.senders.clear();
    message.last_us = now_us;
    const bool is_taken = !message.senders.emplace(place, sender).second;
    if (!is_taken && message.senders.size() < packets_) return 0;
    int of_first = 0;
    for (const auto& held : message.senders) of_first += held.second == 0;
    const bool is_spliced = !is_taken && of_first != 0 && of_first != static_cast<int>(packets_);
    open_.erase(number);
    closed_us_[number] = now_us;
    return is_spliced ? 1 : 0;
  }

  uint32_t packets_;
  double loss_;
  std::mt19937_64 random_;
  std::map<uint32_t, Open> open_;
  std::map<uint32_t, double> closed_us_;
  uint32_t first_[2] = {};  // numbers, drawn by each sender
};

/// Spliced deliveries to be expected in a run of `config` with random ids.
inline double predicted_splices(const OneHopConfig& config) {
  constexpr double kIds = 255;
  constexpr uint32_t kRuns = 400;
  TwinListener twins(config.packets, config.loss, 1);
  double hidden_cost = 0;
  double near_cost = 0;
  for (uint32_t i = 0; i < kRuns; ++i) {
    hidden_cost += twins.splices(config.seconds, UINT32_MAX);
    near_cost += twins.splices(config.seconds, 1);
  }
  const UnitDisk disk(config.side, config.range);
  const uint32_t robots = disk.size();
  double expected = 0;
  for (uint32_t a = 0; a < robots; ++a) {
    for (uint32_t b = a + 1; b < robots; ++b) {
      double listeners = 0;
      for (uint32_t c = 0; c < robots; ++c) listeners += disk.hears(a, c) && disk.hears(b, c);
      const double cost = disk.hears(a, b) ? config.loss * near_cost : hidden_cost;
      expected += listeners / kIds * cost / kRuns;
    }
  }
  return expected;
}

/// Spliced deliveries per run over seeds 1 to `seeds`, and the standard error of that mean.
struct MeasuredSplices {
  double mean = 0;
  double error = 0;
  double intact = 0;
};
template <class P>
MeasuredSplices measured_splices(OneHopConfig config, uint32_t seeds) {
  config.distinct_ids = false;
  double sum = 0;
  double squares = 0;
  MeasuredSplices measured;
  for (config.seed = 1; config.seed <= seeds; ++config.seed) {
    const OneHopResult result = OneHop<P>(config).run();
    const auto spliced = static_cast<double>(result.spliced);
    sum += spliced;
    squares += spliced * spliced;
    measured.intact += static_cast<double>(result.intact) / seeds;
  }
  measured.mean = sum / seeds;
  measured.error = std::sqrt((squares / seeds - measured.mean * measured.mean) / (seeds - 1));
  return measured;
}

}  // namespace swarmtalk::core::testing
