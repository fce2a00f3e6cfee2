// The two vibration motors, by PWM of timer 2 (2 kHz), and moves that end by themselves.
// Calibrated speeds come from EEPROM (eeprom.hpp). Left is the motor at OC2A (PB3): alone, it turns
// the robot left. The same pins and duties as with kilolib; tests/kilobot/judge holds the table.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

/// A duty that was never calibrated: an erased cell of EEPROM.
constexpr uint8_t kNoDuty = 0xFF;
/// What moves a robot without harm, whoever it is.
constexpr uint8_t kModerateDuty = 65;

/// Calibrated PWM duties as they are in EEPROM, kNoDuty if they were never set. Above 90 is not
/// normal, above 120 wears the motors.
struct MotorCalibration {
  uint8_t turn_left;      // left motor alone
  uint8_t turn_right;     // right motor alone
  uint8_t straight_left;  // both together
  uint8_t straight_right;
};

void read_motor_calibration(MotorCalibration& calibration);
void write_motor_calibration(const MotorCalibration& calibration);

/// Lets the motors turn again after disable_motors().
void enable_motors();

/// Cuts the motors off until enable_motors(). Safe in interrupts.
void disable_motors();

/// PWM duty of each motor, 0 to 255, from now on.
void set_motors(uint8_t left, uint8_t right);

/// Turns motors for a while, with a short push at full power that overcomes static friction.
/// Owned by the main loop, which calls poll().
class Motion {
 public:
  /// Moves with these duties; kNoDuty, which no motor bears for long, becomes kModerateDuty.
  /// @param ticks  until it stops by itself; 0: until told otherwise
  void start(uint8_t left, uint8_t right, uint32_t ticks);
  /// Moves with exactly these duties until told otherwise, behind a push of the motors named.
  void push(bool pushes_left, bool pushes_right, uint8_t left, uint8_t right);
  void stop();
  bool is_moving() const { return left_ != 0 || right_ != 0; }
  bool is_pushing() const { return is_pushing_; }
  bool has_duties(uint8_t left, uint8_t right) const { return left == left_ && right == right_; }
  void poll();

 private:
  uint32_t end_tick_ = 0;
  uint16_t push_end_ = 0;  // units
  uint8_t left_ = 0;
  uint8_t right_ = 0;
  bool has_end_ = false;
  bool is_pushing_ = false;
};

}  // namespace kilobot
}  // namespace swarmtalk
