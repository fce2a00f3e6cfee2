#include "platforms/kilobot/motors.hpp"

#include <avr/io.h>
#include <avr/pgmspace.h>
#include <util/atomic.h>

#include "platforms/kilobot/board.hpp"
#include "platforms/kilobot/clock.hpp"
#include "platforms/kilobot/eeprom.hpp"

namespace swarmtalk {
namespace kilobot {

namespace {

/// Full power for 15 ms: static friction is overcome, the motors are not hurt (limit 50 ms).
constexpr uint16_t kPushUnits = 15000 / kMicrosecondsPerUnit + 1;
constexpr uint8_t kPushDuty = 255;

/// Where the duties are, in the order of MotorCalibration.
constexpr uint8_t kDuties = 4;
const uint8_t kAddresses[kDuties] PROGMEM = {kEepromTurnLeft, kEepromTurnRight, kEepromStraightLeft,
                                             kEepromStraightRight};
static_assert(sizeof(MotorCalibration) == kDuties, "the duties lie one behind the other");

}  // namespace

void read_motor_calibration(MotorCalibration& calibration) {
  uint8_t* duties = &calibration.turn_left;
  for (uint8_t i = 0; i < kDuties; ++i) duties[i] = read_eeprom(pgm_read_byte(&kAddresses[i]));
}

void write_motor_calibration(const MotorCalibration& calibration) {
  const uint8_t* duties = &calibration.turn_left;
  for (uint8_t i = 0; i < kDuties; ++i) write_eeprom(pgm_read_byte(&kAddresses[i]), duties[i]);
}

void enable_motors() {
  OCR2A = 0;
  OCR2B = 0;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    DDRB |= 1 << kPinMotorLeft;
    DDRD |= 1 << kPinMotorRight;
  }
}

void disable_motors() {
  TCCR2A = 0;  // the pins belong to the ports again, and are low
  TCCR2B = 0;
  DDRB &= static_cast<uint8_t>(~(1 << kPinMotorLeft));
  DDRD &= static_cast<uint8_t>(~(1 << kPinMotorRight));
}

__attribute__((noinline)) void set_motors(uint8_t left, uint8_t right) {
  OCR2A = left;
  OCR2B = right;
  if (left == 0 && right == 0) {
    TCCR2A = 0;
    TCCR2B = 0;
    return;
  }
  // Phase-correct PWM: a duty of 0 is really off. Clock / 8 / 510 = 1961 Hz.
  TCCR2A = (1 << COM2A1) | (1 << COM2B1) | (1 << WGM20);
  TCCR2B = 1 << CS21;
}

void Motion::start(uint8_t left, uint8_t right, uint32_t duration_ticks) {
  if (left == kNoDuty) left = kModerateDuty;
  if (right == kNoDuty) right = kModerateDuty;
  // A motion that is the same goes on as it is, without another push.
  if (left != left_ || right != right_) push(left != 0, right != 0, left, right);
  has_end_ = duration_ticks != 0;
  end_tick_ = ticks() + duration_ticks;
}

/// Once in flash, not once for each caller.
__attribute__((noinline)) void Motion::push(bool pushes_left, bool pushes_right, uint8_t left,
                                            uint8_t right) {
  has_end_ = false;
  left_ = left;
  right_ = right;
  is_pushing_ = true;
  push_end_ = static_cast<uint16_t>(units() + kPushUnits);
  set_motors(pushes_left ? kPushDuty : uint8_t{0}, pushes_right ? kPushDuty : uint8_t{0});
}

void Motion::stop() {
  left_ = 0;
  right_ = 0;
  is_pushing_ = false;
  set_motors(0, 0);
}

void Motion::poll() {
  if (is_pushing_ && has_come(units(), push_end_)) {
    is_pushing_ = false;
    set_motors(left_, right_);
  }
  if (is_moving() && has_end_ && static_cast<int32_t>(ticks() - end_tick_) >= 0) stop();
}

}  // namespace kilobot
}  // namespace swarmtalk
