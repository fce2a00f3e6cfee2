// Pins of the Kilobot board (ATmega328P at 8 MHz) and what is done to them as a whole.
// LED: a pin drives when it is an output, so its colour is in the direction registers.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

constexpr uint8_t kPinCharging = 0;       // port D, low while the charger is at work
constexpr uint8_t kPinReceiverPower = 2;  // port D
constexpr uint8_t kPinMotorLeft = 3;      // port B, OC2A: turns the robot left (counter-clockwise)
constexpr uint8_t kPinMotorRight = 3;     // port D, OC2B: turns it right
/// Pins of port B that may carry infrared LEDs; not the motor, and not the programmer's.
constexpr uint8_t kTransmitPins = 0xC7;
constexpr uint8_t kDefaultTransmitPins = 0x01;

/// Brings ports, oscillator trim and receiver power into the state that programs expect. First
/// call of an image; interrupts are off.
void start_board();

/// Everything as after a reset: ports, timers, comparator, converter, serial port. For jumps to
/// the bootloader or to address 0, which expect a fresh processor. Leaves interrupts off.
void stop_board();

/// Infrared receiver's supply; off only in deep sleep.
void power_receiver(bool on);

/// Colour of the LED: two bits each for red (bits 6, 7), blue (4, 5) and green (2, 3).
void set_led(uint8_t rgb);
/// @param red, green, blue  0 to 3
constexpr uint8_t led_rgb(uint8_t red, uint8_t green, uint8_t blue) {
  return static_cast<uint8_t>((red << 6) | (blue << 4) | (green << 2));
}
/// The same from 0 to 255 of each, the upper two bits of which count.
constexpr uint8_t led_rgb8(uint8_t red, uint8_t green, uint8_t blue) {
  return static_cast<uint8_t>((red & 0xC0) | (static_cast<uint8_t>(blue >> 2) & 0x30) |
                              (static_cast<uint8_t>(green >> 4) & 0x0C));
}

constexpr uint8_t kLedOff = led_rgb(0, 0, 0);
constexpr uint8_t kLedRed = led_rgb(3, 0, 0);
constexpr uint8_t kLedDimRed = led_rgb(1, 0, 0);
constexpr uint8_t kLedGreen = led_rgb(0, 3, 0);
constexpr uint8_t kLedBlue = led_rgb(0, 0, 3);
constexpr uint8_t kLedDimBlue = led_rgb(0, 0, 1);
constexpr uint8_t kLedYellow = led_rgb(3, 3, 0);
constexpr uint8_t kLedWhite = led_rgb(3, 3, 3);

/// Whether the charger is at work.
bool is_charging();

}  // namespace kilobot
}  // namespace swarmtalk
