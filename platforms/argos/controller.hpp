// What both controllers in ARGoS have in common: a robot is made from its <params>, stepped once
// per ControlStep, and found by the loop functions that keep the log. ARGoS owns controllers, and
// may step several at once on its threads.
#pragma once

#include <argos3/core/control_interface/ci_controller.h>

#include <memory>

#include "platforms/argos/stepped_robot.hpp"

namespace swarmtalk::platforms::in_argos {

using argos::CARGoSException;  // ARGoS's macros call it by this name

constexpr double kMmPerCm = 10;  // ARGoS's wheels and boards count in cm

class Controller : public argos::CCI_Controller {
 public:
  explicit Controller(MakeRobot make) : make_(make) {}

  /// @param params  attributes index, role, random_id, drift_ppm, power_on_spread_us, all optional.
  ///                Without index robots are numbered in the order of the file.
  void Init(argos::TConfigurationNode& params) override;
  void Reset() override;

  SteppedRobot& robot() { return *robot_; }

 protected:
  /// Looks up the sensors and actuators that the experiment file gives to this controller.
  virtual void connect() = 0;

  /// Begins a step. @param was_sent  the robot's packet has left
  void begin_step(bool was_sent) { robot_->begin(++step_, was_sent); }
  /// The LED's colour, if it has changed.
  bool has_new_colour();

 private:
  MakeRobot make_;
  Settings settings_;
  std::unique_ptr<SteppedRobot> robot_;
  uint64_t step_ = 0;
  Colour shown_ = kOff;
  bool has_shown_ = false;
};

}  // namespace swarmtalk::platforms::in_argos
