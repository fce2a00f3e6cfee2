// Hop count on a Kilobot with kilolib: roles by uid as in hop_count.cpp. uids are kilolib's, known
// after kilo_init(), so the program is made inside main().
#include "platforms/kilobot/kilolib/kilolib_robot.hpp"
#include "suite/programs/hop_count.hpp"

using swarmtalk::suite::HopCount;
using swarmtalk::suite::HopCountRole;

int main() {
  kilo_init();
  const HopCountRole role = kilo_uid == 1   ? HopCountRole::kSeed1
                            : kilo_uid == 2 ? HopCountRole::kSeed2
                                            : HopCountRole::kFollower;
  static swarmtalk::kilobot::JoinedOnKilolib<HopCount> joined(role);
  joined.run();
}
