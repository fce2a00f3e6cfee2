// One experiment for two media: stations on a square grid broadcast frames of one length, each at
// random moments. What both have in common: arguments, places, moments, output.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "sim/random.hpp"

namespace swarmtalk::tests {

constexpr double kRangeM = 50;  // of a frame with nobody else on the air

struct Experiment {
  uint32_t stations = 0;
  double spacing_m = 0;
  uint32_t period_us = 0;  // each station wants to send once in each period
  uint32_t payload_bytes = 0;
  double seconds = 0;
  uint64_t seed = 0;

  double x_m(uint32_t station) const { return spacing_m * (station % columns()); }
  double y_m(uint32_t station) const { return spacing_m * (station / columns()); }
  bool are_in_range(uint32_t a, uint32_t b) const {
    return a != b && std::hypot(x_m(a) - x_m(b), y_m(a) - y_m(b)) <= kRangeM;
  }

  /// When a station wants to send, in us.
  std::vector<uint64_t> moments(uint32_t station) const {
    sim::Random random(seed * 1000 + station);
    std::vector<uint64_t> result;
    for (uint64_t start = 0; start + period_us <= static_cast<uint64_t>(seconds * 1e6);
         start += period_us) {
      result.push_back(start + random.below(period_us));
    }
    return result;
  }

 private:
  uint32_t columns() const {
    return static_cast<uint32_t>(std::ceil(std::sqrt(static_cast<double>(stations))));
  }
};

/// STATIONS SPACING_M PERIOD_US PAYLOAD_BYTES SECONDS SEED
inline Experiment experiment(int argc, char** argv) {
  if (argc != 7) {
    std::fprintf(stderr, "usage: %s STATIONS SPACING_M PERIOD_US PAYLOAD_BYTES SECONDS SEED\n",
                 argv[0]);
    std::exit(2);
  }
  Experiment result;
  result.stations = static_cast<uint32_t>(std::atoi(argv[1]));
  result.spacing_m = std::atof(argv[2]);
  result.period_us = static_cast<uint32_t>(std::atoi(argv[3]));
  result.payload_bytes = static_cast<uint32_t>(std::atoi(argv[4]));
  result.seconds = std::atof(argv[5]);
  result.seed = static_cast<uint64_t>(std::atoll(argv[6]));
  return result;
}

/// @param sent  frames by station that went on the air. @param received  by receivers in range
inline void print_result(const Experiment& experiment, const std::vector<uint64_t>& sent,
                         uint64_t received) {
  uint64_t frames = 0;
  uint64_t expected = 0;
  for (uint32_t from = 0; from < experiment.stations; ++from) {
    frames += sent[from];
    for (uint32_t to = 0; to < experiment.stations; ++to) {
      if (experiment.are_in_range(from, to)) expected += sent[from];
    }
  }
  std::printf("{\"sent\": %llu, \"expected\": %llu, \"received\": %llu}\n",
              static_cast<unsigned long long>(frames), static_cast<unsigned long long>(expected),
              static_cast<unsigned long long>(received));
}

}  // namespace swarmtalk::tests
