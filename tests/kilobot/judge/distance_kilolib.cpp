// Our distance beside kilolib's on one processor: for each pair of readings that the judge's tables
// and steps make, both; what differs is counted, and the first such pair is kept.
#include <stdint.h>

#include "platforms/kilobot/distance.hpp"

extern "C" {
#include <kilolib.h>
}
extern "C" uint16_t kilo_irhigh[14];
extern "C" uint16_t kilo_irlow[14];

volatile uint32_t distance_pairs;
volatile uint32_t distance_differences;
volatile uint16_t distance_first[4];  // high and low gain, ours, kilolib's
volatile uint8_t distance_is_done;

namespace {

constexpr uint16_t kReadings = 1024;
constexpr uint16_t kHighStep = 3;
constexpr uint16_t kLowStep = 13;

void compare(uint16_t high, uint16_t low) {
  distance_measurement_t measured;
  measured.high_gain = static_cast<int16_t>(high);
  measured.low_gain = static_cast<int16_t>(low);
  const int16_t ours =
      swarmtalk::kilobot::distance_mm(high, low, kilo_irhigh, kilo_irlow,
                                      [](const uint16_t* table, uint8_t i) { return table[i]; });
  const int16_t theirs = estimate_distance(&measured);
  distance_pairs = distance_pairs + 1;
  if (ours == theirs) return;
  if (distance_differences == 0) {
    distance_first[0] = high;
    distance_first[1] = low;
    distance_first[2] = static_cast<uint16_t>(ours);
    distance_first[3] = static_cast<uint16_t>(theirs);
  }
  distance_differences = distance_differences + 1;
}

}  // namespace

int main() {
  kilo_init();  // reads the tables
  for (uint16_t high = 0; high < kReadings; high = static_cast<uint16_t>(high + kHighStep)) {
    // The plain reading counts only where the amplified one is strong.
    const uint16_t step = high <= 700 ? kReadings : kLowStep;
    for (uint16_t low = static_cast<uint16_t>(high % kLowStep); low < kReadings;
         low = static_cast<uint16_t>(low + step)) {
      compare(high, low);
    }
  }
  distance_is_done = 1;
  for (;;) {
  }
}
