// A program on a simulated swarm: one world, one observed robot and one program per place. Owns all
// of it; single-threaded.
#pragma once

#include <cstdint>
#include <cstdio>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "platforms/observed_robot.hpp"
#include "platforms/sim/world_robot.hpp"
#include "suite/programs/make.hpp"
#include "suite/sim/scenario.hpp"

namespace swarmtalk::suite {

/// @tparam Robot    what the program sees: ObservedRobot<WorldRobot<Model>>
/// @tparam Program  of that robot
template <class Robot, class Program>
class Simulation {
 public:
  using World = typename Robot::World;
  using Profile = typename Robot::Profile;
  using Recorder = platforms::Recorder;

  using Sent = std::function<void(uint32_t robot, std::span<const uint8_t> packet)>;

  /// @param first_id  node id of the first robot, unless they draw theirs
  Simulation(const Scenario& scenario, const sim::WorldConfig& config, std::FILE* log,
             uint32_t first_id = 0)
      : scenario_(scenario), world_(config, scenario.seed), recorder_(log), first_id_(first_id) {
    for (const Placement& place : scenario.robots) {
      const uint32_t index = world_.add(place.x_mm, place.y_mm, place.theta_rad);
      sites_.emplace_back(recorder_, world_, index);
    }
  }

  /// Runs to the scenario's end, or until `is_stopped` says so. @return virtual seconds done
  template <class IsStopped>
  double run(IsStopped is_stopped) {
    for (uint32_t i = 0; i < world_.size(); ++i) write_links(i);
    start(nullptr);
    const uint64_t end_us = static_cast<uint64_t>(scenario_.seconds * 1e6);
    while (world_.now_us() < end_us && !is_stopped()) {
      world_.run_until(std::min(end_us, world_.now_us() + kSliceUs));
    }
    finish();
    return static_cast<double>(world_.now_us()) / 1e6;
  }

  /// In place of run(), for whoever moves the world's clock: before, and behind it.
  /// @param sent  is called for each packet that goes on the air; may be empty
  void start(Sent sent) {
    sent_ = std::move(sent);
    world_.start({this, &on_loop, &on_restart, sent_ ? &on_sent : nullptr});
  }
  void finish() {
    for (uint32_t i = 0; i < world_.size(); ++i) write_end(i);
  }

  World& world() { return world_; }

 private:
  static constexpr uint64_t kSliceUs = 1000000;  // between two looks at is_stopped
  static constexpr uint64_t kPoseUs = 250000;    // between two poses of a moving robot in the log

  struct Site {
    Site(Recorder& recorder, World& world, uint32_t index) : robot(recorder, world, index) {}
    Robot robot;
    std::optional<Program> program;
    uint64_t pose_us = 0;
    double x_mm = -1e9;
    double y_mm = 0;
    double theta_rad = 0;
  };

  static void on_loop(void* self, uint32_t index) {
    Simulation& me = *static_cast<Simulation*>(self);
    Site& site = me.sites_[index];
    if (!site.program) me.set_up(index);
    site.robot.poll();
    site.program->loop();
    if (me.recorder_.is_on() && me.world_.now_us() - site.pose_us >= kPoseUs) me.write_pose(index);
  }

  static void on_sent(void* self, uint32_t index, const uint8_t* packet, uint16_t size) {
    static_cast<Simulation*>(self)->sent_(index, {packet, size});
  }

  static void on_restart(void* self, uint32_t index) {
    Simulation& me = *static_cast<Simulation*>(self);
    me.sites_[index].program.reset();
    me.sites_[index].robot.forget();
    me.recorder_.event(me.world_.now_us(), index, "\"event\":\"restart\"");
  }

  void set_up(uint32_t index) {
    Site& site = sites_[index];
    if (!scenario_.has_random_ids) {
      // All ones means "no node".
      world_.node(index).set_node_id(static_cast<typename World::Node::NodeId>(
          (first_id_ + index) % core::Wire<Profile>::kNoNode));
    }
    make(site.program, static_cast<Program*>(nullptr), site.robot, scenario_.robots[index].role,
         index);
    configure(*site.program, scenario_);
    site.program->setup();
    recorder_.event(world_.now_us(), index, "\"event\":\"start\",\"node\":%u",
                    static_cast<unsigned>(world_.node(index).node_id()));
  }

  void write_links(uint32_t index) {
    if (!recorder_.is_on()) return;
    std::string list;
    for (const uint32_t other : world_.listeners(index)) {
      list += (list.empty() ? "" : ",") + std::to_string(other);
    }
    recorder_.event(0, index, "\"event\":\"links\",\"to\":[%s]", list.c_str());
  }

  void write_pose(uint32_t index) {
    Site& site = sites_[index];
    const sim::Body& body = world_.body(index);
    site.pose_us = world_.now_us();
    if (site.x_mm == body.x_mm && site.y_mm == body.y_mm && site.theta_rad == body.theta_rad)
      return;
    site.x_mm = body.x_mm;
    site.y_mm = body.y_mm;
    site.theta_rad = body.theta_rad;
    recorder_.pose(world_.now_us(), index, body.x_mm, body.y_mm, body.theta_rad);
  }

  void write_end(uint32_t index) {
    const auto& counters = world_.node(index).counters();
    recorder_.event(
        world_.now_us(), index,
        "\"event\":\"end\",\"node\":%u,\"contacts\":%llu,\"packets_sent\":%u,\"messages_sent\":%u,"
        "\"messages_received\":%u,\"bad\":%u,\"no_memory\":%u,\"aged_out\":%u,\"id_changes\":%u",
        static_cast<unsigned>(world_.node(index).node_id()),
        static_cast<unsigned long long>(world_.contacts(index)), counters.packets_sent,
        counters.messages_sent, counters.messages_received,
        counters.bad_packets + counters.bad_checksums, counters.no_memory, counters.aged_out,
        counters.id_changes);
  }

  const Scenario& scenario_;
  World world_;
  Recorder recorder_;
  uint32_t first_id_;
  Sent sent_;
  std::deque<Site> sites_;  // never moved: programs keep pointers to their robot
};

}  // namespace swarmtalk::suite
