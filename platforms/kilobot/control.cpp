#include "platforms/kilobot/control.hpp"

#include "kilobot_wire/battery.hpp"
#include "platforms/kilobot/adc.hpp"
#include "platforms/kilobot/board.hpp"
#include "platforms/kilobot/clock.hpp"
#include "platforms/kilobot/eeprom.hpp"
#include "platforms/kilobot/ir_receiver.hpp"
#include "platforms/kilobot/restart.hpp"

namespace swarmtalk {
namespace kilobot {

namespace {

/// Flashes of 1 ms, 200 ms apart.
constexpr uint16_t kFlashPeriodUnits = 1570;
constexpr uint16_t kFlashUnits = 9;
constexpr uint16_t kSleepGlanceUnits = 78;   // 10 ms: listen after waking from deep sleep
constexpr uint16_t kSleepListenUnits = 781;  // 100 ms: after something was heard

/// Modes of a calibration message.
enum CalibrationMode : uint8_t { kSave, kSetUid, kTurnLeft, kTurnRight, kStraight };

/// Listens for `duration` units. @return whether a pulse came
bool listen(uint16_t duration) {
  const uint16_t end = static_cast<uint16_t>(units() + duration);
  bool found = false;
  while (!has_come(units(), end)) found = found || is_receiving();
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
  moves_ = 0;
  motion_.stop();
  flash_units_ = units();
}

void Control::run() {
  if (state_ == State::kRunning || state_ == State::kSetup) return;
  set_state(is_set_up_ ? State::kRunning : State::kSetup);
  is_set_up_ = true;
  enable_motors();
}

void Control::begin_moving() {
  if (state_ == State::kMoving) return;
  set_state(State::kMoving);
  enable_motors();
}

/// A message that comes again changes nothing; a new mode or duty begins with a push.
void Control::move(uint8_t mode, uint8_t left, uint8_t right) {
  if (moves_ == mode && motion_.has_duties(left, right)) return;
  moves_ = mode;
  if (mode <= kSetUid) {
    motion_.stop();
  } else {
    motion_.push(mode != kTurnRight, mode != kTurnLeft, left, right);
  }
}

void Control::show_uid_bit(uint8_t bit) {
  if (state_ != State::kMoving) set_led(kLedOff);
  begin_moving();
  const bool is_one = bit < 16 && ((uid_ >> bit) & 1) != 0;
  const uint8_t duty = motors_.turn_left == kNoDuty ? kModerateDuty : motors_.turn_left;
  move(is_one ? uint8_t{kTurnLeft} : uint8_t{0}, is_one ? duty : uint8_t{0}, 0);
}

void Control::save_calibration() {
  if (state_ != State::kMoving) return;
  write_eeprom(kEepromUid, static_cast<uint8_t>(uid_));
  write_eeprom(kEepromUid + 1, static_cast<uint8_t>(uid_ >> 8));
  write_motor_calibration(motors_);
  set_state(State::kIdle);
  disable_motors();
}

void Control::calibrate(const uint8_t* data) {
  const uint8_t mode = data[0];
  if (mode == kSave) return save_calibration();
  begin_moving();
  uint8_t left = 0;
  uint8_t right = 0;
  if (mode == kSetUid) {
    uid_ = static_cast<uint16_t>(data[1] | (static_cast<uint16_t>(data[2]) << 8));
  } else if (mode == kTurnLeft) {
    motors_.turn_left = left = data[3];
  } else if (mode == kTurnRight) {
    motors_.turn_right = right = data[4];
  } else if (mode == kStraight) {
    motors_.straight_left = left = data[5];
    motors_.straight_right = right = data[6];
  } else {
    return;
  }
  move(mode, left, right);
}

/// A flash at a time: it is as long as it is, whatever the main loop has to do.
void Control::flash(uint8_t rgb) {
  const uint16_t start = units();
  if (!has_come(start, flash_units_)) return;
  flash_units_ = static_cast<uint16_t>(start + kFlashPeriodUnits);
  set_led(rgb);
  while (static_cast<uint16_t>(units() - start) < kFlashUnits) {
  }
  set_led(kLedOff);
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
      flash(kLedDimRed);
    } else {
      set_led(kLedOff);
    }
  }
  motion_.poll();
  if (state_ == State::kSleeping) sleep();
}

}  // namespace kilobot
}  // namespace swarmtalk
