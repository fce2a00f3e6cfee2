// Robots of one kind on a plane, one radio (unit disk, independent loss per receiver, no
// collisions, no air time), virtual time in ticks. As swarm.hpp, and beside that each robot has
// its own time between two packets and its own clock rate, may be paused, and need not be the
// library's: an ideal node goes through the same scene. Everything follows from the seed;
// single-threaded.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <queue>
#include <random>
#include <set>
#include <vector>

#include "tests/swarm/core_robot.hpp"
#include "tests/swarm/ledger.hpp"
#include "tests/swarm/unit_disk.hpp"

namespace swarmtalk::core::testing {

struct SceneConfig {
  double range = 1.5;  // in the unit of the positions
  double loss = 0;     // share of receptions that fail, each by itself
  double jitter = 0;   // of the time between two packets, uniform, to both sides
  double drift = 0;    // largest deviation of a robot's clock and pace, uniform, to both sides
  uint64_t seed = 1;
};

/// @tparam Robot  CoreRobot<P> or IdealRobot<P>
template <class Robot>
class Scene {
 public:
  using W = typename Robot::W;
  using Settings = typename Robot::Settings;

  Scene(const SceneConfig& config, const Settings& settings)
      : config_(config),
        disk_(config.range),
        settings_(settings),
        random_(config.seed),
        seeds_(config.seed + 1000003) {
    hooks_.message = [this](uint32_t robot, const uint8_t* bytes, uint16_t size) {
      ledger_.delivered(robot, bytes, size);
      if (on_message) on_message(robot, bytes, size);
    };
    hooks_.sent = [this](uint32_t robot) {
      if (on_sent) on_sent(robot);
    };
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  /// @param slot_ticks  between two of its packets; 0: it never sends
  void add(double x, double y, double slot_ticks) {
    auto member = std::make_unique<Member>();
    disk_.add(x, y);
    member->clock = {&now_ticks_, 1 + config_.drift * symmetric()};
    member->slot_ticks = slot_ticks / member->clock.rate;
    const auto index = static_cast<uint32_t>(members_.size());
    do {
      member->robot = std::make_unique<Robot>(settings_, hooks_, index, member->clock, seeds_());
    } while (settings_.ids == Ids::kDistinct && !ids_.insert(member->robot->id()).second);
    members_.push_back(std::move(member));
  }
  /// Once, after the last robot: finds who hears whom, gives each its first slot at random.
  void connect() {
    disk_.connect();
    for (uint32_t i = 0; i < size(); ++i) {
      const double slot = members_[i]->slot_ticks;
      if (slot > 0) slots_.push({uniform() * slot, i});
      if (slot > longest_slot_) longest_slot_ = slot;
    }
    ledger_.set_robots(size());
  }

  /// @return false, and counted as refused, while the robot's message before has not left, and
  /// after
  ///         the last number that a tag holds
  bool publish(uint32_t robot, uint8_t packets) {
    uint8_t bytes[Tag::kMaxPackets * Tag::kBytes];
    const Tag tag = ledger_.next(robot, packets);
    if (ledger_.published_by(robot) > UINT16_MAX ||
        !members_[robot]->robot->send(bytes, write_message(tag, bytes))) {
      ledger_.refused();
      return false;
    }
    ledger_.published(tag);
    return true;
  }
  void run_until(double end_ticks) {
    while (!slots_.empty() && slots_.top().at_ticks <= end_ticks) {
      const Slot slot = slots_.top();
      slots_.pop();
      now_ticks_ = slot.at_ticks;
      Member& member = *members_[slot.robot];
      if (!member.is_paused) transmit(slot.robot);
      const double stretch = 1 + config_.jitter * symmetric();
      slots_.push({slot.at_ticks + member.slot_ticks * stretch, slot.robot});
    }
    now_ticks_ = end_ticks;
  }
  /// Runs on until nobody has had anything to send for a while, or for `most_ticks`.
  void drain(double most_ticks) {
    const double end_ticks = now_ticks_ + most_ticks;
    uint64_t before = 0;
    do {
      before = ledger_.counts().transmissions;
      run_until(now_ticks_ + 3 * longest_slot_);
    } while (ledger_.counts().transmissions != before && now_ticks_ < end_ticks);
  }
  /// A paused robot's node is not called at all; its clock goes on.
  void set_paused(uint32_t robot, bool is_paused) { members_[robot]->is_paused = is_paused; }
  void restart(uint32_t robot) { members_[robot]->robot->restart(); }

  /// What was counted so far.
  Counts counts() {
    Counts counts = ledger_.counts();
    for (const auto& member : members_) {
      counts.id_collisions += member->robot->id_collisions();
      counts.id_changes += member->robot->id_changes();
    }
    return counts;
  }
  Ledger& ledger() { return ledger_; }
  Robot& robot(uint32_t i) { return *members_[i]->robot; }
  const std::vector<uint32_t>& neighbours(uint32_t i) const { return disk_.neighbours(i); }
  uint32_t size() const { return static_cast<uint32_t>(members_.size()); }
  double now_ticks() const { return now_ticks_; }
  std::mt19937_64& random() { return random_; }
  double uniform() { return std::uniform_real_distribution<double>()(random_); }

  /// Puts a packet on the air as if robot `from` had sent it.
  void broadcast(uint32_t from, const uint8_t* packet, uint16_t size) {
    ledger_.transmitted();
    for (uint32_t to : disk_.neighbours(from)) {
      if (config_.loss > 0 && uniform() < config_.loss) continue;
      Member& member = *members_[to];
      if (member.is_paused) continue;
      ledger_.arrived(to, packet + W::kHeaderBytes);
      member.robot->receive(packet, size);
    }
  }

  std::function<void(uint32_t robot)> on_sent;
  std::function<void(uint32_t robot, const uint8_t* bytes, uint16_t size)> on_message;
  /// Asked before a robot's slot; true: it is used up.
  std::function<bool(uint32_t robot)> on_slot;

 private:
  struct Member {
    double slot_ticks = 0;
    bool is_paused = false;
    RobotClock clock;
    std::unique_ptr<Robot> robot;
  };
  struct Slot {
    double at_ticks;
    uint32_t robot;
    bool operator<(const Slot& other) const {
      return at_ticks != other.at_ticks ? at_ticks > other.at_ticks : robot > other.robot;
    }
  };

  double symmetric() { return 2 * uniform() - 1; }
  void transmit(uint32_t from) {
    if (on_slot && on_slot(from)) return;
    uint8_t packet[W::kMtuBytes];
    const uint16_t size = members_[from]->robot->pull(packet);
    if (size != 0) broadcast(from, packet, size);
  }

  SceneConfig config_;
  UnitDisk disk_;
  Settings settings_;
  RobotHooks hooks_;
  std::mt19937_64 random_;  // phases, jitter, losses
  std::mt19937_64 seeds_;   // of the robots' own random numbers
  double now_ticks_ = 0;
  double longest_slot_ = 0;
  Ledger ledger_;
  std::vector<std::unique_ptr<Member>> members_;
  std::set<uint32_t> ids_;  // drawn at the start
  std::priority_queue<Slot> slots_;
};

/// What several runs of a scene count, from the seeds 1 to `seeds`, added up.
template <class Run, class Config, class... Settings>
Counts from_seeds(Config config, uint32_t seeds, const Settings&... settings) {
  Counts sum;
  for (config.seed = 1; config.seed <= seeds; ++config.seed) sum += Run(config, settings...).run();
  return sum;
}

}  // namespace swarmtalk::core::testing
