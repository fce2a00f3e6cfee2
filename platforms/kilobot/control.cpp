#include "platforms/kilobot/control.hpp"

#include "platforms/kilobot/adc.hpp"
#include "platforms/kilobot/board.hpp"
#include "platforms/kilobot/clock.hpp"
#include "platforms/kilobot/eeprom.hpp"
#include "platforms/kilobot/ir_receiver.hpp"
#include "platforms/kilobot/restart.hpp"

namespace swarmtalk {
namespace kilobot {

namespace {

/// Battery readings (of 1023) above which the LED is green, blue, yellow; below, red.
constexpr int16_t kBatteryFull = 682;
constexpr int16_t kBatteryGood = 648;
constexpr int16_t kBatteryLow = 614;

/// A flash every 0.2 s, 5 ms long: longer than a pass of the main loop.
constexpr uint16_t kFlashPeriodUnits = 1562;
constexpr uint16_t kFlashUnits = 40;
constexpr uint16_t kSleepGlanceUnits = 78;   // 10 ms: listen after waking from deep sleep
constexpr uint16_t kSleepListenUnits = 781;  // 100 ms: after something was heard

/// Modes of a calibration message.
enum CalibrationMode : uint8_t { kSave, kSetUid, kTurnLeft, kTurnRight, kStraight };

/// Listens for `duration` units. @return whether a pulse or a message came
bool listen(uint16_t duration) {
  const uint16_t end = static_cast<uint16_t>(units() + duration);
  const uint8_t heard = receptions_heard();
  bool found = false;
  while (!has_come(units(), end)) found = found || is_receiving() || heard != receptions_heard();
  return found;
}

}  // namespace

/// Bootloader and restart must work whatever the program does; motors stop at once.
void on_urgent_message(uint8_t type) {
  if (type == kIrBoot) enter_bootloader();
  if (type == kIrReset) restart_program();
  if (type != kIrRun && type != kIrReadUid && type != kIrCalibrate) disable_motors();
}

void Control::start() {
  uid_ = read_uid();
  read_motor_calibration(motors_);
  enable_motors();
}

void Control::handle(const IrMessage& message) {
  const uint8_t type = message.type;
  if (type >= kIrSleep && type <= kIrVoltage) set_state(static_cast<State>(type ^ kIrWakeup));
  if (type == kIrRun) run();
  if (type == kIrReadUid) show_uid_bit(message.data[0]);
  if (type == kIrCalibrate) calibrate(message.data);
}

void Control::set_state(State state) {
  if (state == state_) return;
  state_ = state;
  motion_.stop();
  set_led(kLedOff);
}

void Control::run() {
  if (state_ == State::kRunning || state_ == State::kSetup) return;
  set_state(is_set_up_ ? State::kRunning : State::kSetup);
  is_set_up_ = true;
  enable_motors();
}

void Control::move(uint8_t left, uint8_t right) {
  if (state_ != State::kMoving) enable_motors();
  set_state(State::kMoving);
  motion_.start(left, right, 0);
}

void Control::show_uid_bit(uint8_t bit) {
  const bool is_one = ((uid_ >> (bit & 15)) & 1) != 0;
  move(is_one ? motors_.turn_left : uint8_t{0}, 0);
}

void Control::calibrate(const uint8_t* data) {
  switch (data[0]) {
    case kSave:
      if (state_ != State::kMoving) return;
      write_eeprom(kEepromUid, static_cast<uint8_t>(uid_));
      write_eeprom(kEepromUid + 1, static_cast<uint8_t>(uid_ >> 8));
      write_motor_calibration(motors_);
      set_state(State::kIdle);
      break;
    case kSetUid:
      uid_ = static_cast<uint16_t>(data[1] | (static_cast<uint16_t>(data[2]) << 8));
      move(0, 0);
      break;
    case kTurnLeft:
      motors_.turn_left = data[3];
      move(motors_.turn_left, 0);
      break;
    case kTurnRight:
      motors_.turn_right = data[4];
      move(0, motors_.turn_right);
      break;
    case kStraight:
      motors_.straight_left = data[5];
      motors_.straight_right = data[6];
      move(motors_.straight_left, motors_.straight_right);
      break;
    default:
      break;
  }
}

void Control::flash(uint8_t rgb) {
  set_led(units() % kFlashPeriodUnits < kFlashUnits ? rgb : kLedOff);
}

void Control::show_battery() {
  const int16_t reading = read_battery();
  if (reading < 0) return;  // a message arrives: keep the colour
  set_led(reading > kBatteryFull   ? kLedGreen
          : reading > kBatteryGood ? kLedBlue
          : reading > kBatteryLow  ? kLedYellow
                                   : kLedRed);
}

void Control::sleep() {
  stop_receiver();
  power_receiver(false);
  set_led(kLedOff);
  sleep_deeply();
  power_receiver(true);
  start_receiver();
  set_led(kLedWhite);
  if (listen(kSleepGlanceUnits)) {
    set_led(kLedRed);
    listen(kSleepListenUnits);
  }
  set_led(kLedOff);
}

void Control::poll() {
  if (state_ == State::kIdle) flash(kLedGreen);
  if (state_ == State::kBattery) show_battery();
  if (state_ == State::kCharging) {
    if (is_charging()) {
      flash(kLedRed);
    } else {
      set_led(kLedOff);
    }
  }
  motion_.poll();
  if (state_ == State::kSleeping) sleep();
}

}  // namespace kilobot
}  // namespace swarmtalk
