// Prints the swarm rows of docs/benchmarks.md: one hop, floods, delays; all from seed 1.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/support/profiles.hpp"
#include "tests/swarm/flood.hpp"
#include "tests/swarm/one_hop.hpp"
#include "tests/swarm/splice_model.hpp"

namespace {

using namespace swarmtalk::core::testing;

double percent(uint64_t part, uint64_t whole) {
  return whole == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

template <class P>
void one_hop(const char* memory, bool distinct_ids) {
  std::printf("\n### One hop, 36 robots, %s, %s ids\n\n", memory,
              distinct_ids ? "distinct" : "random");
  std::printf(
      "Intact %% of possible %%; of the best policy in the same memory; spliced.\n\n"
      "| neighbours | loss | 1 packet | 2 packets | 4 packets | 8 packets |\n"
      "|---|---|---|---|---|---|\n");
  for (double range : {1.5, 3.2}) {
    for (double loss : {0.0, 0.05, 0.2}) {
      for (uint8_t packets : {uint8_t{1}, uint8_t{2}, uint8_t{4}, uint8_t{8}}) {
        OneHopConfig config;
        config.range = range;
        config.loss = loss;
        config.packets = packets;
        config.distinct_ids = distinct_ids;
        const OneHopResult result = OneHop<P>(config).run();
        if (packets == 1) std::printf("| %.1f | %.0f %%", result.neighbours, 100 * loss);
        std::printf(" | %.1f of %.1f; %.1f %%; %llu", percent(result.intact, result.intended),
                    percent(result.possible, result.intended),
                    percent(result.intact, result.bound()),
                    static_cast<unsigned long long>(result.spliced));
      }
      std::printf(" |\n");
    }
  }
}

void splices() {
  std::printf(
      "\n### Spliced deliveries with random ids, memory for all, 60 s, 60 seeds\n\n"
      "Per run: mean, its standard error, and what tests/swarm/splice_model.hpp predicts.\n\n"
      "| neighbours | loss | packets | spliced | standard error | predicted | intact |\n"
      "|---|---|---|---|---|---|---|\n");
  for (double range : {1.5, 3.2}) {
    for (double loss : {0.0, 0.05, 0.2}) {
      for (uint8_t packets : {uint8_t{2}, uint8_t{4}, uint8_t{8}}) {
        OneHopConfig config;
        config.range = range;
        config.loss = loss;
        config.packets = packets;
        config.seconds = 60;
        const double predicted = predicted_splices(config);
        const MeasuredSplices measured = measured_splices<RoomForAll>(config, 60);
        std::printf("| %s | %.0f %% | %u | %.2f | %.2f | %.2f | %.0f |\n",
                    range < 2 ? "6.1" : "20.3", 100 * loss, packets, measured.mean, measured.error,
                    predicted, measured.intact);
      }
    }
  }
}

void print_flood(const FloodConfig& config) {
  const FloodResult result = Flood<RoomFor20>(config).run();
  std::printf("| %u | %u | %.0f %% | %u | %.2f of %.2f | %.3f | %llu | %llu | %llu |\n",
              config.side * config.side, config.ttl, 100 * config.loss, config.packets,
              100 * result.coverage(), 100 * result.reachable(),
              result.cost(config.side * config.side, config.packets),
              static_cast<unsigned long long>(result.duplicates),
              static_cast<unsigned long long>(result.to_self),
              static_cast<unsigned long long>(result.spliced));
}

void floods() {
  std::printf(
      "\n### Floods from a corner, 20 fragments, 10 forward slots\n\n"
      "| robots | TTL | loss | packets | coverage %% of physically possible | transmissions / "
      "ideal | duplicates | to self | spliced |\n|---|---|---|---|---|---|---|---|---|\n");
  for (uint8_t ttl : {uint8_t{9}, uint8_t{12}}) {
    for (double loss : {0.0, 0.05, 0.2}) {
      for (uint8_t packets : {uint8_t{1}, uint8_t{4}, uint8_t{8}}) {
        FloodConfig config;
        config.ttl = ttl;
        config.loss = loss;
        config.packets = packets;
        print_flood(config);
      }
    }
  }
}

void print_delay(const char* what, const FloodConfig& config) {
  FloodResult result = Flood<RoomForAll>(config).run();
  for (double& error : result.delay_errors) error = std::fabs(error);
  std::sort(result.delay_errors.begin(), result.delay_errors.end());
  const auto at = [&](double share) {
    return result.delay_errors[static_cast<size_t>(
        static_cast<double>(result.delay_errors.size() - 1) * share)];
  };
  std::printf("| %s | %.0f %% | %u | %.2f | %.2f | %.2f |\n", what, 100 * config.loss,
              config.packets, at(0.5), at(0.99), at(1.0));
}

void delays() {
  std::printf(
      "\n### Delay error in ticks (the tick itself is 1)\n\n"
      "| way | loss | packets | median | p99 | max |\n|---|---|---|---|---|---|\n");
  for (double loss : {0.0, 0.2}) {
    for (uint8_t packets : {uint8_t{1}, uint8_t{4}}) {
      FloodConfig config;
      config.side = 6;
      config.loss = loss;
      config.packets = packets;
      config.timestamped = true;
      config.ttl = 0;
      config.all_publish = true;
      config.period_s = 6;
      config.seconds = 600;
      print_delay("one hop", config);
      config.ttl = 5;
      config.all_publish = false;
      config.period_s = 30;
      config.seconds = 2400;
      print_delay("flood, TTL 5", config);
    }
  }
}

}  // namespace

int main() {
  one_hop<RoomForAll>("memory for all", true);
  one_hop<RoomForAll>("memory for all", false);
  one_hop<RoomFor20>("memory for 20 fragments", true);
  splices();
  floods();
  delays();
  return 0;
}
