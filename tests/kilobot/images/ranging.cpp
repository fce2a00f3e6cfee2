// ranging.hpp on our hardware layer.
#include "tests/kilobot/images/ranging.hpp"

#include "platforms/kilobot/join.hpp"

volatile uint16_t ranging_heard;
volatile int16_t ranging_distance_mm;

swarmtalk::kilobot::Joined<swarmtalk::kilobot::Ranging> joined;

int main() {
  joined.run();
}
