// A deterministic swarm in one process: robots with clocks that drift, bodies that bump and radios
// that collide, driven by one event queue. Everything follows from the seed; same seed, same bytes.
// Used by the suite's simulated platforms and by benchmarks; single-threaded. The node of each
// robot is the real core::Swarmtalk<P>. For packets without air time and bodies see swarm.hpp.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "sim/event_queue.hpp"
#include "sim/grid.hpp"
#include "sim/interference.hpp"
#include "sim/random.hpp"
#include "sim/robot_clock.hpp"
#include "sim/robot_radio.hpp"
#include "sim/sensing.hpp"
#include "sim/world_config.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::sim {

/// What the world calls. `robot` counts from 0. Null functions are left out.
struct Hooks {
  void* context = nullptr;
  void (*loop)(void* context, uint32_t robot) = nullptr;     // once per tick of the robot's clock
  void (*restart)(void* context, uint32_t robot) = nullptr;  // its node is new: set it up again
  /// A packet goes on the air; in this world's, too.
  void (*sent)(void* context, uint32_t robot, const uint8_t* packet, uint16_t size) = nullptr;
};

struct WorldConfig {
  RadioConfig radio;
  BodyConfig body;
  ClockConfig clock;
  std::vector<Fault> faults;
};

template <class P>
class World {
 public:
  using Node = core::Swarmtalk<P>;

  World(const WorldConfig& config, uint64_t seed)
      : config_(config),
        seed_(seed),
        random_(seed),
        grid_(std::fmax(config.radio.range_mm * (1 + config.radio.asymmetry),
                        config.body.diameter_mm)) {}
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Adds a robot; all must be there before start().
  uint32_t add(double x_mm, double y_mm, double theta_rad = 0) {
    const uint32_t index = size();
    robots_.push_back(std::make_unique<Robot>(now_us_, mix(seed_ ^ mix(index + 1))));
    Robot& robot = *robots_.back();
    robot.body = Body(config_.body, x_mm, y_mm, theta_rad, robot.random);
    const int64_t drift = config_.clock.drift_ppm;
    const auto drift_ppm = static_cast<int32_t>(
        static_cast<int64_t>(robot.random.below(2 * config_.clock.drift_ppm + 1)) - drift);
    robot.clock = {drift_ppm, robot.random.below(config_.clock.power_on_spread_us + 1)};
    grid_.add(index, x_mm, y_mm);
    return index;
  }

  /// Gives each robot its first turn and its first pass of the loop; `hooks` are called from
  /// run_until() from now on.
  void start(const Hooks& hooks) {
    hooks_ = hooks;
    for (uint32_t i = 0; i < size(); ++i) switch_on(i, robots_[i]->clock.power_on_us());
    for (uint32_t i = 0; i < config_.faults.size(); ++i) {
      queue_.push(config_.faults[i].at_us, i << kKindBits | kFault);
    }
  }

  /// Runs until virtual time `end_us`.
  void run_until(uint64_t end_us) {
    Event event{};
    while (queue_.pop(end_us, event)) {
      prefetch();
      now_us_ = event.at_us;
      const uint32_t index = event.what >> kKindBits;
      switch (event.what & ((1u << kKindBits) - 1)) {
        case kLoop:
          run_loop(index);
          break;
        case kTurn:
          take_turn(index);
          break;
        case kEnd:
          end_transmission(index);
          break;
        default:
          start_fault(config_.faults[index]);
          break;
      }
    }
    now_us_ = end_us;
  }

  /// When something happens next, if that is by `end_us`.
  std::optional<uint64_t> next_us(uint64_t end_us) { return queue_.next_us(end_us); }

  /// A robot hears a packet that comes from elsewhere than this world, now. @return as its node
  core::Error hear(uint32_t robot, const uint8_t* packet, uint16_t size,
                   const typename P::Sensing& sensing) {
    if (!robots_[robot]->is_alive) return core::Error::kOk;
    return robots_[robot]->node->on_packet(packet, size, sensing);
  }

  uint64_t now_us() const { return now_us_; }
  uint32_t size() const { return static_cast<uint32_t>(robots_.size()); }
  const WorldConfig& config() const { return config_; }
  const AirCounters& air() const { return air_; }
  /// Body contacts of one robot's own moves.
  uint64_t contacts(uint32_t robot) const { return robots_[robot]->contacts; }

  Node& node(uint32_t robot) { return *robots_[robot]->node; }
  Body& body(uint32_t robot) { return robots_[robot]->body; }
  bool is_alive(uint32_t robot) const { return robots_[robot]->is_alive; }
  uint32_t ticks(uint32_t robot) const { return robots_[robot]->ticks(); }
  uint32_t random(uint32_t robot) { return static_cast<uint32_t>(robots_[robot]->random.bits()); }

  /// Robots that hear `robot` where it stands now, nearest index first.
  std::vector<uint32_t> listeners(uint32_t robot) {
    std::vector<uint32_t> result;
    std::vector<Link> links;  // the robot's own are in use while it sends
    find_links(robot, links);
    for (const Link& link : links) result.push_back(link.to);
    return result;
  }

 private:
  enum Kind : uint32_t { kLoop, kTurn, kEnd, kFault };
  static constexpr unsigned kKindBits = 2;
  using Damage = RobotRadio::Damage;

  struct Link {
    uint32_t to;
    float distance_mm;
  };

  struct Robot {
    Robot(const uint64_t& now, uint64_t seed) : now_us(now), random(seed) { renew(); }

    void renew() { node.emplace(core::Port{&read_clock, &draw, this}); }
    uint32_t ticks() const { return clock.ticks(now_us); }
    static uint32_t read_clock(void* self) { return static_cast<Robot*>(self)->ticks(); }
    static uint32_t draw(void* self) {
      return static_cast<uint32_t>(static_cast<Robot*>(self)->random.bits());
    }

    const uint64_t& now_us;  // of the world
    RobotClock clock;
    RobotRadio radio;
    bool is_alive = false;
    bool knows_links = false;
    bool has_loop_waiting = false;
    bool has_turn_waiting = false;
    Random random;
    std::vector<Link> links;  // of the last transmission, or valid if knows_links
    Body body;
    uint64_t contacts = 0;
    uint8_t packet[P::kMtuBytes];  // on the air
    uint16_t packet_bytes = 0;
    std::optional<Node> node;
  };

  void switch_on(uint32_t index, uint64_t at_us) {
    Robot& robot = *robots_[index];
    robot.is_alive = true;
    // A robot that was dead for a moment still has its events waiting.
    if (!robot.has_loop_waiting) queue_.push(at_us, index << kKindBits | kLoop);
    if (!robot.has_turn_waiting) {
      queue_.push(at_us + robot.random.below(config_.radio.period_us), index << kKindBits | kTurn);
    }
    robot.has_loop_waiting = robot.has_turn_waiting = true;
  }

  void run_loop(uint32_t index) {
    Robot& robot = *robots_[index];
    robot.has_loop_waiting = robot.is_alive;
    if (!robot.is_alive) return;
    if (robot.body.is_driving()) move(index, robot);
    if (hooks_.loop != nullptr) hooks_.loop(hooks_.context, index);
    queue_.push(now_us_ + robot.clock.true_us(kTickUs), index << kKindBits | kLoop);
  }

  void move(uint32_t index, Robot& robot);
  void take_turn(uint32_t index);
  void transmit(uint32_t index, Robot& robot);
  void arrive(uint32_t from, const Link& link);
  void end_transmission(uint32_t index);
  void finish(uint32_t from, const Link& link);
  void start_fault(const Fault& fault);
  void interrupt_reception(Robot& robot);
  void forget_links_near(const Body& body) {
    grid_.for_near(body.x_mm, body.y_mm,
                   [this](uint32_t other) { robots_[other]->knows_links = false; });
  }
  const std::vector<Link>& links_of(uint32_t index);
  void find_links(uint32_t index, std::vector<Link>& out) const;
  double reach_mm(uint32_t from, uint32_t to) const;

  void prefetch() const {
    if (const Event* event = queue_.peek(3)) {
      const uint32_t index = event->what >> kKindBits;
      if (index >= robots_.size()) return;  // a fault's number
      const char* robot = reinterpret_cast<const char*>(robots_[index].get());
      __builtin_prefetch(robot);
      __builtin_prefetch(robot + 64);
      __builtin_prefetch(robot + 128);
    }
  }

  WorldConfig config_;
  uint64_t seed_;
  Random random_;
  Grid grid_;
  EventQueue queue_;
  Hooks hooks_;
  std::vector<std::unique_ptr<Robot>> robots_;
  AirCounters air_;
  Interference interference_;
  uint64_t now_us_ = 0;
};

}  // namespace swarmtalk::sim

#include "sim/world_air.hpp"
#include "sim/world_body.hpp"
