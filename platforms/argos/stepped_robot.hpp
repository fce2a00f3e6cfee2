// What ARGoS's controllers drive: one robot with its node and its program, a step at a time. The
// glue feeds it packets, carries its wheels, LED and packet to ARGoS, and nothing else. Each robot
// is stepped by one thread at a time; several threads may step different robots.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "platforms/argos/models.hpp"
#include "platforms/argos/settings.hpp"

namespace swarmtalk::platforms::in_argos {

class SteppedRobot {
 public:
  virtual ~SteppedRobot() = default;

  virtual const char* platform() const = 0;
  virtual uint32_t index() const = 0;

  /// Step `step` of the simulation begins, counted from 1. @param was_sent  the packet has left
  virtual void begin(uint64_t step, bool was_sent) = 0;
  /// A packet has come, and how far away its transmitter is; bearing in the robot's own frame.
  virtual void hear(const uint8_t* bytes, uint16_t size, double distance_mm,
                    double bearing_rad) = 0;
  /// The program runs once.
  virtual void run() = 0;

  // What the robot wants until its next step.
  virtual const Wheels& wheels() const = 0;
  virtual Colour colour() const = 0;
  virtual uint16_t packet_bytes() const = 0;  // 0: nothing to send
  virtual const uint8_t* packet() const = 0;

  /// From now on events are kept.
  virtual void start_log() = 0;
  /// Lines since the last call, in the suite's format (docs/suite.md).
  virtual std::string take_log() = 0;
  /// The `pose` event, for a robot that moves.
  virtual void log_pose(double x_mm, double y_mm, double theta_rad) = 0;
  /// The `end` event. @param contacts  steps in which it touched something
  virtual void log_end(uint64_t contacts) = 0;
};

/// What a module gives to the glue.
using MakeRobot = std::unique_ptr<SteppedRobot> (*)(const Settings& settings);

}  // namespace swarmtalk::platforms::in_argos
