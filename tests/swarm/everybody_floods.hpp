// Every robot of a grid floods: at once at the start of each period (bursts), or in turns within
// it. The period follows from the load: the share of one packet per robot and slot that all floods
// together make every robot send.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include "tests/swarm/scene.hpp"

namespace swarmtalk::core::testing {

enum class Timing { kBursts, kSpread, kRandom };

struct EverybodyConfig : SceneConfig {
  EverybodyConfig() { jitter = 0.1; }

  uint32_t side = 6;
  uint8_t packets = 1;
  bool mixed_lengths = false;  // 1 to 8 packets at random; `packets` unused
  double load = 0.5;
  uint32_t reached = 0;  // robots that send on each flood, as the load counts them; 0: all
  Timing timing = Timing::kBursts;
  uint32_t periods = 20;
  uint8_t ttl = 12;
  double slot_ticks = 16;
  uint8_t channels = 1;
  Ids ids = Ids::kDistinct;
};

template <class Robot>
class EverybodyFloods {
 public:
  explicit EverybodyFloods(const EverybodyConfig& config,
                           typename Robot::Settings settings = typename Robot::Settings())
      : config_(config), scene_(config, filled_in(settings, config)) {
    for (uint32_t i = 0; i < config.side * config.side; ++i) {
      scene_.add(i % config.side, i / config.side, config.slot_ticks);
    }
    scene_.connect();
  }

  Counts run() {
    const double mean_packets = config_.mixed_lengths ? 4.5 : config_.packets;
    const uint32_t reached = config_.reached == 0 ? scene_.size() : config_.reached;
    const double period = reached * mean_packets / config_.load * config_.slot_ticks;
    for (uint32_t n = 0; n < config_.periods; ++n) {
      for (const Turn& turn : turns()) {
        scene_.run_until((n + turn.at) * period);
        scene_.publish(turn.robot, length());
      }
    }
    scene_.run_until(config_.periods * period);
    scene_.drain(20 * period);
    return scene_.counts();
  }
  Scene<Robot>& scene() { return scene_; }

 private:
  static typename Robot::Settings filled_in(typename Robot::Settings settings,
                                            const EverybodyConfig& config) {
    settings.ttl = config.ttl;
    settings.channels = config.channels;
    settings.ids = config.ids;
    return settings;
  }
  struct Turn {
    double at;  // share of the period
    uint32_t robot;
    bool operator<(const Turn& other) const {
      return at != other.at ? at < other.at : robot < other.robot;
    }
  };
  /// Who publishes when in the next period; spread turns come in one order.
  std::vector<Turn> turns() {
    std::vector<Turn> turns;
    for (uint32_t i = 0; i < scene_.size(); ++i) {
      const uint32_t robot = (i * 7 + 3) % scene_.size();
      double at = 0;
      if (config_.timing == Timing::kSpread) at = 1.0 * i / scene_.size();
      if (config_.timing == Timing::kRandom) at = static_cast<double>(draws_()) / 4294967296.0;
      turns.push_back({at, robot});
    }
    std::sort(turns.begin(), turns.end());
    return turns;
  }
  uint8_t length() {
    return config_.mixed_lengths ? static_cast<uint8_t>(1 + draws_() % 8) : config_.packets;
  }

  EverybodyConfig config_;
  Scene<Robot> scene_;
  std::mt19937 draws_{static_cast<uint32_t>(config_.seed * 7919 + 1)};  // lengths and times
};

/// The same from several seeds, added up.
template <class Robot>
Counts everybody_floods(const EverybodyConfig& config, uint32_t seeds,
                        const typename Robot::Settings& settings = typename Robot::Settings()) {
  return from_seeds<EverybodyFloods<Robot>>(config, seeds, settings);
}

}  // namespace swarmtalk::core::testing
