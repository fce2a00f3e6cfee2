// The hop-count follower on two channels, on a robot without drivers. Its size is measured, and the
// emulator (cycles.cpp) feeds it packets through memory and counts the cycles of each call.
#include "suite/programs/hop_count.hpp"
#include "tests/avr/bare_robot.hpp"

namespace {
swarmtalk::BareRobot robot;
swarmtalk::suite::HopCount<swarmtalk::BareRobot> program(robot,
                                                         swarmtalk::suite::HopCountRole::kFollower);
}  // namespace

// The emulator writes the packet and the command, and reads the result.
extern "C" {
volatile uint8_t command;  // 1: receive, 2: pull, 0: done
uint8_t packet[9];
volatile uint8_t result;
}

int main() {
  program.setup();
  for (;;) {
    program.loop();
    if (command == 1) {
      GPIOR1 = 1;
      result = static_cast<uint8_t>(
          robot.swarmtalk().on_packet(packet, sizeof packet, swarmtalk::core::DistanceSensing{50}));
      GPIOR1 = 0;
    } else if (command == 2) {
      GPIOR1 = 2;
      result = static_cast<uint8_t>(robot.swarmtalk().pull_packet(packet));
      GPIOR1 = 0;
    }
    command = 0;
  }
}
