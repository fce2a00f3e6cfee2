// A robot whose node is not called for a while, again and again, while its neighbours send at their
// links' own rate: on waking it holds packets of messages that are long over, under numbers that
// have come back, some of them in its queue. Nothing may be spliced, however long the pause was.
#pragma once

#include <cstdint>
#include <random>

#include "tests/swarm/scene.hpp"

namespace swarmtalk::core::testing {

struct PauseConfig {
  double pause_ticks = 300;
  uint32_t pauses = 100;
  uint8_t ttl = 0;
  double slot_ticks = 2;  // of the neighbours; the robot itself sends on every 16 ticks
  uint8_t packets = 4;
  uint32_t neighbours = 3;   // all hear each other
  uint32_t senders = 3;      // of these; in floods the others send on
  double awake_ticks = 125;  // between two pauses, on average
  uint64_t seed = 1;
};

/// In long pauses the neighbours send at the beginning and at the end only.
template <class P>
Counts pauses(const PauseConfig& config) {
  SceneConfig scene_config;
  scene_config.range = 1e9;
  scene_config.jitter = 0.1;
  scene_config.seed = config.seed;
  typename CoreRobot<P>::Settings settings;
  settings.ttl = config.ttl;
  Scene<CoreRobot<P>> scene(scene_config, settings);
  for (uint32_t i = 0; i <= config.neighbours; ++i) {
    scene.add(i, 0, i == 0 ? 16 : config.slot_ticks);
  }
  scene.connect();
  bool is_quiet = false;
  scene.on_sent = [&](uint32_t robot) {
    if (!is_quiet) scene.publish(robot, config.packets);
  };
  const auto set_quiet = [&](bool quiet) {
    is_quiet = quiet;
    for (uint32_t i = 1; !quiet && i <= config.senders; ++i) scene.publish(i, config.packets);
  };
  const auto run_for = [&](double ticks) { scene.run_until(scene.now_ticks() + ticks); };
  set_quiet(false);
  for (uint32_t n = 0; n < config.pauses; ++n) {
    run_for(config.awake_ticks * (0.4 + 1.2 * scene.uniform()));
    scene.set_paused(0, true);
    const double busy_ticks = 100 + 100 * scene.uniform();
    if (config.pause_ticks <= 2 * busy_ticks) {
      run_for(config.pause_ticks);
    } else {
      run_for(busy_ticks);
      set_quiet(true);
      run_for(config.pause_ticks - 2 * busy_ticks);
      set_quiet(false);
      run_for(busy_ticks);
    }
    scene.set_paused(0, false);
  }
  return scene.counts();
}

}  // namespace swarmtalk::core::testing
