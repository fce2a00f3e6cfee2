// A Kilobot's states and the control messages that change them, as its users know them from the
// overhead controller: idle, run, pause, sleep, voltage, charge, calibration. Called by the main
// loop; what must work even in a hung program is done in the interrupt (on_urgent_message).
#pragma once

#include <stdint.h>

#include "kilobot_wire/ir_message.hpp"
#include "platforms/kilobot/motors.hpp"

namespace swarmtalk {
namespace kilobot {

/// The first four are numbered like the messages that lead to them.
enum class State : uint8_t {
  kIdle = kIrWakeup ^ kIrWakeup,      // green flashes
  kSleeping = kIrSleep ^ kIrWakeup,   // powered down, listens every 8 s
  kBattery = kIrVoltage ^ kIrWakeup,  // LED shows the voltage
  kCharging = kIrCharge ^ kIrWakeup,  // LED red while the charger is at work
  kSetup,                             // about to call the program's setup()
  kRunning,                           // the program runs
  kMoving,                            // motors turn for calibration
};

class Control {
 public:
  /// Reads uid and motor calibration; the state is kIdle.
  void start();

  /// Takes a message of type kIrFirstControl or above.
  void handle(const IrMessage& message);

  /// LED and motors of the current state; sleeps if it is to. Once per pass of the main loop.
  void poll();

  /// The program's setup() has been called.
  void on_set_up() { state_ = State::kRunning; }

  State state() const { return state_; }
  uint16_t uid() const { return uid_; }
  const MotorCalibration& motors() const { return motors_; }
  /// The program's moves while RUNNING, those of calibration else; a change of state ends them.
  Motion& motion() { return motion_; }

 private:
  void set_state(State state);
  void run();
  void show_uid_bit(uint8_t bit);
  void calibrate(const uint8_t* data);
  void save_calibration();
  void begin_moving();
  void move(uint8_t mode, uint8_t left, uint8_t right);
  void show_battery();
  void sleep();
  void flash(uint8_t rgb);

  MotorCalibration motors_ = {};
  uint16_t uid_ = 0;
  Motion motion_;
  State state_ = State::kIdle;  // 0: the object needs no constructor
  bool is_set_up_ = false;
  uint8_t moves_ = 0;         // mode of the calibration that moves the robot, 0: none
  uint16_t flash_units_ = 0;  // when the LED flashes next
};

}  // namespace kilobot
}  // namespace swarmtalk
