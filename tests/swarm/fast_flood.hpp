// Floods at the link's own rate: a sender hands over its next message whenever the last has left.
// In one place, where all hear each other and everybody relays at once; on a line; on a grid.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tests/swarm/scene.hpp"

namespace swarmtalk::core::testing {

enum class Place {
  kCrowd,  // everybody hears everybody
  kLine,   // robot 0 at one end
  kGrid,   // square, range 1.5: eight neighbours; robot 0 in a corner
};

struct FastFloodConfig : SceneConfig {
  Place place = Place::kCrowd;
  uint32_t robots = 2;  // sender included; of a grid a square number
  uint8_t packets = 1;
  uint8_t ttl = 3;
  double sender_ticks = 2;  // between two packets
  double relay_ticks = 2;
  bool all_send = false;    // everybody, each at its own pace
  uint32_t messages = 300;  // of each sender
  Ids ids = Ids::kFixed;
};

template <class Robot>
class FastFlood {
 public:
  explicit FastFlood(const FastFloodConfig& config,
                     typename Robot::Settings settings = typename Robot::Settings())
      : config_(config), scene_(scene_config(config), with_ttl(settings, config)) {
    const auto side = static_cast<uint32_t>(std::lround(std::sqrt(config.robots)));
    for (uint32_t i = 0; i < config.robots; ++i) {
      const uint32_t column = config.place == Place::kGrid ? i % side : i;
      const uint32_t row = config.place == Place::kGrid ? i / side : 0;
      scene_.add(column, row, i == 0 ? config.sender_ticks : config.relay_ticks);
    }
    scene_.connect();
    scene_.on_sent = [this](uint32_t robot) { publish(robot); };
  }

  Counts run() {
    const uint32_t senders = config_.all_send ? config_.robots : 1;
    for (uint32_t i = 0; i < senders; ++i) publish(i);
    scene_.drain(20000 + 4.0 * senders * config_.messages * config_.packets *
                             std::max(config_.sender_ticks, config_.relay_ticks));
    return scene_.counts();
  }
  Scene<Robot>& scene() { return scene_; }

 private:
  static SceneConfig scene_config(const FastFloodConfig& config) {
    SceneConfig scene = config;
    if (config.place == Place::kCrowd) scene.range = 1e9;
    return scene;
  }
  static typename Robot::Settings with_ttl(typename Robot::Settings settings,
                                           const FastFloodConfig& config) {
    settings.ttl = config.ttl;
    settings.ids = config.ids;
    return settings;
  }
  void publish(uint32_t robot) {
    if (scene_.ledger().published_by(robot) < config_.messages) {
      scene_.publish(robot, config_.packets);
    }
  }

  FastFloodConfig config_;
  Scene<Robot> scene_;
};

/// The same from several seeds, added up.
template <class Robot>
Counts fast_flood(const FastFloodConfig& config, uint32_t seeds) {
  return from_seeds<FastFlood<Robot>>(config, seeds);
}

}  // namespace swarmtalk::core::testing
