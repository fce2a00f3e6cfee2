// A sender with a fixed id floods, is replaced by a fresh node with the same id in the middle of a
// message or between two, and floods on. Counts which of its first messages after that are heard,
// and what is spliced.
//
// How many splices are to be expected. A fresh node begins at a number drawn from all 16. A
// listener that holds the first packets of the message that was cut off cannot tell a message under
// the same number from its rest: it looks like a sender that repeats what it had sent. Only the
// very next message can do that: with any other number the sender has passed the cut one, which is
// over then. So of the restarts that cut a message, and after which the listener still waits for
// the rest, one in 16 costs a listener one splice. A node that waits for `assembly_ticks` sees
// those after whose pause less time has passed. That holds for the sender's neighbours. Farther off
// it is more: there up to eight of the first numbers are taken for copies, and do not count as
// messages that have passed the cut one.
#pragma once

#include <cstdint>
#include <random>

#include "tests/swarm/fast_flood.hpp"
#include "tests/swarm/scene.hpp"

namespace swarmtalk::core::testing {

struct RestartConfig {
  uint32_t receivers = 1;  // in a line, the sender at its end
  uint8_t packets = 1;
  uint8_t ttl = 3;
  double slot_ticks = 16;  // of all
  uint32_t restarts = 200;
  double loss = 0;
  double least_pause_ticks = 0;  // of those below
  uint64_t seed = 1;
};

struct RestartResult {
  static constexpr uint32_t kFirst = 16;  // messages after a restart

  Counts counts;
  uint64_t restarts = 0;
  uint64_t intended = 0;  // (message, receiver) pairs of the first ones after each
  uint64_t heard = 0;
  uint64_t cut = 0;  // restarts in the middle of a message
  double splices_predicted = 0;

  double share_heard() const { return Counts::share(heard, intended); }
};

template <class P>
class Restart {
 public:
  explicit Restart(const RestartConfig& config) : config_(config), random_(config.seed) {}

  /// Each restart in a scene of its own.
  RestartResult run() {
    for (uint32_t i = 0; i < config_.restarts; ++i) run_one();
    return result_;
  }

 private:
  static constexpr uint32_t kPauses[] = {0, 2, 16, 100, 400};  // ticks

  void run_one() {
    SceneConfig scene_config;
    scene_config.loss = config_.loss;
    scene_config.jitter = 0.1;
    scene_config.seed = random_();
    typename CoreRobot<P>::Settings settings;
    settings.ttl = config_.ttl;
    Scene<CoreRobot<P>> scene(scene_config, settings);
    for (uint32_t i = 0; i <= config_.receivers; ++i) scene.add(i, 0, config_.slot_ticks);
    scene.connect();

    const auto before = static_cast<uint32_t>(1 + random_() % 40);
    const auto of_next = static_cast<uint32_t>(random_() % config_.packets);
    uint32_t pause = kPauses[random_() % 5];
    while (pause < config_.least_pause_ticks) pause = kPauses[random_() % 5];
    uint32_t packets_left = before * config_.packets + of_next;
    uint32_t messages_left = before + (of_next != 0 ? 1 : 0);
    scene.on_slot = [&](uint32_t robot) {
      if (robot != 0) return false;
      if (packets_left == 0) return true;
      --packets_left;
      return false;
    };
    scene.on_sent = [&](uint32_t robot) {
      if (robot != 0 || messages_left == 0) return;
      --messages_left;
      scene.publish(0, config_.packets);
    };
    scene.on_sent(0);
    while (packets_left != 0) scene.run_until(scene.now_ticks() + 1);
    scene.run_until(scene.now_ticks() + pause);

    scene.restart(0);
    packets_left = UINT32_MAX;
    messages_left = RestartResult::kFirst;
    const uint32_t first = scene.ledger().published_by(0);
    scene.on_sent(0);
    scene.drain(1e6);
    tally(scene, first);
    if (of_next != 0) {
      ++result_.cut;
      if (pause <= P::kFloodTicks) result_.splices_predicted += config_.receivers / 16.0;
    }
  }
  void tally(Scene<CoreRobot<P>>& scene, uint32_t first) {
    ++result_.restarts;
    result_.counts += scene.counts();
    for (uint32_t to = 1; to < scene.size(); ++to) {
      for (uint32_t n = 0; n < RestartResult::kFirst; ++n) {
        ++result_.intended;
        result_.heard += scene.ledger().is_delivered(to, 0, first + n);
      }
    }
  }

  RestartConfig config_;
  std::mt19937_64 random_;
  RestartResult result_;
};

}  // namespace swarmtalk::core::testing
