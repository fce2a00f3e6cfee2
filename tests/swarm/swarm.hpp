// A deterministic swarm in one process: many nodes, one virtual clock, one radio medium (unit disk,
// independent loss per receiver, no collisions, no air time). Everything follows from the seed.
// Single-threaded.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <queue>
#include <random>
#include <vector>

#include "swarmtalk/swarmtalk.hpp"
#include "tests/swarm/unit_disk.hpp"

namespace swarmtalk::core::testing {

struct MediumConfig {
  double range = 1.5;          // in the unit of the positions
  double loss = 0;             // share of receptions that fail, each by itself
  uint32_t slot_us = 500'000;  // time between two transmissions of a robot
  double jitter = 0.1;         // uniform, as a share of slot_us
  uint32_t tick_us = 32'000;   // one tick of the nodes' clocks
  uint32_t clock_start = 0;    // ticks at time 0, to bring a wrap near
};

/// One robot: its node and its port.
template <class P>
class SwarmRobot {
 public:
  SwarmRobot(const uint64_t* now_us, const MediumConfig& config, uint64_t seed)
      : now_us_(now_us), config_(config), random_(seed), node(Port{&clock, &draw, this}) {}

  uint32_t ticks() const {
    return static_cast<uint32_t>(config_.clock_start + *now_us_ / config_.tick_us);
  }
  uint32_t random() { return static_cast<uint32_t>(random_()); }

 private:
  static uint32_t clock(void* self) { return static_cast<SwarmRobot*>(self)->ticks(); }
  static uint32_t draw(void* self) { return static_cast<SwarmRobot*>(self)->random(); }
  const uint64_t* now_us_;
  const MediumConfig& config_;
  std::mt19937 random_;

 public:
  Swarmtalk<P> node;
};

template <class P>
class Swarm {
 public:
  using Robot = SwarmRobot<P>;

  Swarm(const MediumConfig& config, uint64_t seed)
      : config_(config), disk_(config.range), random_(seed) {}

  /// Adds a robot at (x, y). Call connect() after the last.
  Robot& add(double x, double y) {
    robots_.push_back(std::make_unique<Robot>(&now_us_, config_, random_()));
    disk_.add(x, y);
    return *robots_.back();
  }

  /// Finds who hears whom, and gives each robot its first slot at random within one.
  void connect() {
    disk_.connect();
    for (uint32_t i = 0; i < size(); ++i) {
      slots_.push({static_cast<uint64_t>(random_() % config_.slot_us), i});
    }
  }

  /// Runs until virtual time `end_us`; every robot pulls one packet per slot.
  void run_until(uint64_t end_us) {
    while (!slots_.empty() && slots_.top().at_us <= end_us) {
      const Slot slot = slots_.top();
      slots_.pop();
      now_us_ = slot.at_us;
      transmit(slot.robot);
      const double stretch = 1 + config_.jitter * (2 * uniform() - 1);
      slots_.push({slot.at_us + static_cast<uint64_t>(config_.slot_us * stretch), slot.robot});
    }
    now_us_ = end_us;
  }

  uint64_t now_us() const { return now_us_; }
  uint32_t size() const { return static_cast<uint32_t>(robots_.size()); }
  Robot& robot(uint32_t i) { return *robots_[i]; }
  const UnitDisk& disk() const { return disk_; }

  /// Called with each packet that leaves a robot, and before each that arrives.
  std::function<void(uint32_t from, const uint8_t* packet, uint16_t size)> on_transmit;
  std::function<void(uint32_t to, uint32_t from, const uint8_t* packet, uint16_t size)> on_arrive;

 private:
  struct Slot {
    uint64_t at_us;
    uint32_t robot;
    bool operator<(const Slot& other) const {
      return at_us != other.at_us ? at_us > other.at_us : robot > other.robot;
    }
  };

  double uniform() { return static_cast<double>(random_()) / 4294967296.0; }

  void transmit(uint32_t from) {
    uint8_t packet[P::kMtuBytes];
    const uint16_t size = robots_[from]->node.pull_packet(packet);
    if (size == 0) return;
    if (on_transmit) on_transmit(from, packet, size);
    for (uint32_t to : disk_.neighbours(from)) {
      if (uniform() < config_.loss) continue;
      if (on_arrive) on_arrive(to, from, packet, size);
      robots_[to]->node.on_packet(packet, size, sensing(to, from));
    }
  }

  /// Distance in hundredths of the positions' unit, at most what the type holds.
  typename P::Sensing sensing(uint32_t to, uint32_t from) const {
    typename P::Sensing sensing{};
    sensing.distance = static_cast<typename P::Sensing::Distance>(
        std::fmin(100 * disk_.distance(to, from), 32000));
    return sensing;
  }

  MediumConfig config_;
  UnitDisk disk_;
  std::mt19937 random_;
  uint64_t now_us_ = 0;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::priority_queue<Slot> slots_;
};

}  // namespace swarmtalk::core::testing
