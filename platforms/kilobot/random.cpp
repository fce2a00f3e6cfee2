#include "platforms/kilobot/random.hpp"

#include "platforms/kilobot/adc.hpp"
#include "platforms/kilobot/eeprom.hpp"

namespace swarmtalk {
namespace kilobot {

namespace {

uint32_t state;

/// One step of a linear congruential generator modulo 2^32 (multiplier 1664525, Knuth, The Art of
/// Computer Programming vol. 2, sec. 3.3.4); the high half is the good one.
void step() {
  state = state * UINT32_C(1664525) + UINT32_C(1013904223);
}

/// One fair bit: two readings' lowest bits that differ (von Neumann), so a steady converter that
/// favours one value does not show. 0 after 16 pairs without a difference.
uint8_t noise_bit() {
  for (uint8_t i = 0; i < 16; ++i) {
    const uint8_t first = static_cast<uint8_t>(read_battery() & 1);
    const uint8_t second = static_cast<uint8_t>(read_battery() & 1);
    if (first != second) return first;
  }
  return 0;
}

}  // namespace

uint8_t random_hard() {
  uint8_t byte = 0;
  for (uint8_t i = 0; i < 8; ++i) byte = static_cast<uint8_t>((byte << 1) | noise_bit());
  return byte;
}

void seed_random() {
  for (uint8_t i = 0; i < 4; ++i) {
    stir_random(random_hard());
    // Readings whose noise is rare still differ in value from robot to robot.
    stir_random(static_cast<uint8_t>(read_battery()));
  }
  const uint16_t uid = read_uid();
  stir_random(static_cast<uint8_t>(uid));
  stir_random(static_cast<uint8_t>(uid >> 8));
}

void stir_random(uint8_t noise) {
  state ^= noise;
  step();
}

uint16_t random16() {
  step();
  return static_cast<uint16_t>(state >> 16);
}

uint32_t random32() {
  const uint32_t high = random16();
  return (high << 16) | random16();
}

}  // namespace kilobot
}  // namespace swarmtalk
