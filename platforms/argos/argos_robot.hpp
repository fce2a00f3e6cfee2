// A robot in ARGoS as programs see it (platforms/robot.hpp): its node, its clock of the
// simulation's steps, and what LED and wheels are told. The glue carries that to ARGoS after each
// step. One per robot, called in that robot's step; shares nothing with others.
#pragma once

#include <cstdint>

#include "platforms/argos/models.hpp"
#include "platforms/argos/settings.hpp"
#include "sim/random.hpp"

namespace swarmtalk::platforms::in_argos {

template <class Model>
class ArgosRobot {
 public:
  using Profile = typename Model::Profile;
  using Distance = typename Profile::Sensing::Distance;
  using Node = core::Swarmtalk<Profile>;
  static constexpr uint16_t kBodyMm = Model::kBodyMm;
  static constexpr uint16_t kSpeedMmPerS = Model::kSpeedMmPerS;
  static constexpr uint16_t kTurnDegPerS = Model::kTurnDegPerS;
  static constexpr uint32_t kTicksPerSecond = kStepsPerSecond;

  explicit ArgosRobot(const Settings& settings)
      : index_(settings.index),
        random_(sim::mix(settings.seed) + settings.index),
        rate_ppm_(1000000 + random_.symmetric() * settings.drift_ppm),
        first_step_(1 + random_.below(1 + steps_of(settings.power_on_spread_us))),
        node_(core::Port{&read_clock, &draw, this}) {
    // All ones means "no node".
    if (!settings.has_random_id) {
      node_.set_node_id(static_cast<typename Node::NodeId>(index_ % 255));
    }
  }
  ArgosRobot(const ArgosRobot&) = delete;
  ArgosRobot& operator=(const ArgosRobot&) = delete;

  Node& swarmtalk() { return node_; }
  uint32_t clock() {
    return static_cast<uint32_t>(static_cast<double>(step_) * rate_ppm_ / 1000000);
  }
  uint32_t random() { return static_cast<uint32_t>(random_.bits() >> 32); }
  static Distance distance(int32_t mm) { return clamped_mm(mm); }
  void led(Colour colour) { colour_ = colour; }
  void forward(uint32_t ticks) { move(Model::kAhead, ticks); }
  void left(uint32_t ticks) { move(Model::kLeft, ticks); }
  void right(uint32_t ticks) { move(Model::kRight, ticks); }
  void stop() { move(Wheels{}, 0); }
  bool is_moving() const { return wheels_.left_mm_per_s != 0 || wheels_.right_mm_per_s != 0; }
  void log(const char*, int32_t) {}

  /// The simulation's step `step` begins: ends timed moves.
  void poll(uint64_t step) {
    step_ = step;
    if (is_moving() && for_ticks_ != 0 && clock() - since_ >= for_ticks_) stop();
  }

  /// The step from which on the robot is switched on.
  uint64_t first_step() const { return first_step_; }
  sim::Random& generator() { return random_; }
  const Wheels& wheels() const { return wheels_; }
  Colour colour() const { return colour_; }
  uint32_t index() const { return index_; }
  uint64_t time_us() const { return step_ * 1000000 / kStepsPerSecond; }

 private:
  static uint32_t steps_of(uint32_t us) {
    return static_cast<uint32_t>(uint64_t{us} * kStepsPerSecond / 1000000);
  }
  static uint32_t read_clock(void* self) { return static_cast<ArgosRobot*>(self)->clock(); }
  static uint32_t draw(void* self) { return static_cast<ArgosRobot*>(self)->random(); }

  void move(const Wheels& wheels, uint32_t ticks) {
    wheels_ = wheels;
    since_ = clock();
    for_ticks_ = ticks;
  }

  uint32_t index_;
  sim::Random random_;
  double rate_ppm_;
  uint64_t first_step_;
  uint64_t step_ = 0;
  Wheels wheels_;
  Colour colour_ = kOff;
  uint32_t since_ = 0;
  uint32_t for_ticks_ = 0;
  Node node_;
};

}  // namespace swarmtalk::platforms::in_argos
