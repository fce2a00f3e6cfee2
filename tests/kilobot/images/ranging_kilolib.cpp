// ranging.hpp on kilolib.
#include "platforms/kilobot/kilolib/kilolib_robot.hpp"
#include "tests/kilobot/images/ranging.hpp"

volatile uint16_t ranging_heard;
volatile int16_t ranging_distance_mm;

int main() {
  kilo_init();
  static swarmtalk::kilobot::JoinedOnKilolib<swarmtalk::kilobot::Ranging> joined;
  joined.run();
}
