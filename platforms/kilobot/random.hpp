// Random numbers: a fast generator, seeded from electrical noise so that equal robots that were
// switched on together differ. Not for secrets.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

/// Seeds the generator from the lowest bits of the converter and the robot's uid, about 10 ms.
/// Interrupts must be on or the converter unused by the receiver.
void seed_random();

/// Stirs something unpredictable into the generator, such as the time of a message.
void stir_random(uint8_t noise);

/// 16 uniform bits.
uint16_t random16();

/// 32 uniform bits.
uint32_t random32();

/// One byte straight from electrical noise, up to 5 ms; 0 if the converter shows none.
uint8_t random_hard();

}  // namespace kilobot
}  // namespace swarmtalk
