// Firefly synchronisation on a Kilobot: one image for all robots.
#include "suite/programs/firefly.hpp"

#include "platforms/kilobot/join.hpp"

swarmtalk::kilobot::Joined<swarmtalk::suite::Firefly> joined;

int main() {
  joined.run();
}
