#include "emulation/kilobot/robot_body.hpp"

#include <cmath>

#include "emulation/kilobot/atmega328p.hpp"

namespace swarmtalk::emulator {

namespace reg = atmega328p;

namespace {

std::uint8_t level(std::uint8_t outputs, unsigned one, unsigned two) {
  return static_cast<std::uint8_t>(((outputs >> one) & 1) + 2 * ((outputs >> two) & 1));
}

std::uint8_t pin_duty(const Mcu& mcu, std::uint8_t connected, std::uint16_t compare,
                      std::uint16_t direction, std::uint16_t port, unsigned bit) {
  if (((mcu.data(direction) >> bit) & 1) == 0) return 0;
  const bool has_clock = (mcu.data(reg::kTccr2b) & reg::kClock2Mask) != 0;
  if ((mcu.data(reg::kTccr2a) & connected) != 0 && has_clock) return mcu.data(compare);
  return ((mcu.data(port) >> bit) & 1) != 0 ? 255 : 0;
}

double effort(std::uint8_t duty) {
  return duty < kMotorThreshold ? 0 : duty / kNominalDuty;
}

}  // namespace

LedColour read_led(const Mcu& mcu) {
  const std::uint8_t c = mcu.data(reg::kDdrC), d = mcu.data(reg::kDdrD);
  return {level(d, 5, 4), level(c, 3, 2), level(c, 5, 4)};
}

MotorDuty read_motors(const Mcu& mcu) {
  return {pin_duty(mcu, reg::kCom2a1, reg::kOcr2a, reg::kDdrB, reg::kPortB, 3),
          pin_duty(mcu, reg::kCom2b1, reg::kOcr2b, reg::kDdrD, reg::kPortD, 3)};
}

BodyPose move(const BodyPose& pose, const MotorDuty& duty, double seconds, const MotorGain& gain) {
  const double left = effort(duty.left) * gain.left, right = effort(duty.right) * gain.right;
  const double turned_rad = (left - right) * kTurnRadPerS * seconds;
  const double forward_mm = (left + right) / 2 * kForwardMmPerS * seconds;
  const double heading_rad = pose.theta_rad + turned_rad / 2;
  return {pose.x_mm + forward_mm * std::cos(heading_rad),
          pose.y_mm + forward_mm * std::sin(heading_rad), pose.theta_rad + turned_rad};
}

}  // namespace swarmtalk::emulator
