// The experiment of broadcast.hpp on the medium of sim/.
#include <algorithm>
#include <tuple>

#include "sim/wifi_air.hpp"
#include "tests/air/broadcast.hpp"

int main(int argc, char** argv) {
  using namespace swarmtalk;
  const tests::Experiment experiment = tests::experiment(argc, argv);
  sim::WifiAirConfig config;
  config.range_mm = tests::kRangeM * 1000;
  config.queue_frames = 500;
  uint64_t received = 0;
  sim::WifiAir air(config, experiment.seed,
                   {[&](uint32_t from, uint32_t to, std::span<const uint8_t>) {
                      received += experiment.are_in_range(from, to);
                      return true;
                    },
                    {}});
  std::vector<std::pair<uint64_t, uint32_t>> moments;
  for (uint32_t station = 0; station < experiment.stations; ++station) {
    air.add(experiment.x_m(station) * 1000, experiment.y_m(station) * 1000);
    for (const uint64_t at_us : experiment.moments(station)) moments.emplace_back(at_us, station);
  }
  std::sort(moments.begin(), moments.end());
  const std::vector<uint8_t> frame(config.header_bytes + experiment.payload_bytes);
  for (const auto& [at_us, station] : moments) air.offer(station, frame, at_us);
  air.run(static_cast<uint64_t>(experiment.seconds * 1e6));
  std::vector<uint64_t> sent;
  for (uint32_t station = 0; station < experiment.stations; ++station) {
    sent.push_back(air.counters(station).sent);
  }
  tests::print_result(experiment, sent, received);
  return 0;
}
