// Edge following on a Kilobot: robots with uid 1 to 4 are the seeds, all others follow.
#include "suite/programs/edge_following.hpp"

#include "platforms/kilobot/join.hpp"

namespace {

using swarmtalk::suite::EdgeRole;

uint8_t number() {
  return static_cast<uint8_t>(swarmtalk::kilobot::read_uid());
}

EdgeRole role() {
  return number() >= 1 && number() <= 4 ? EdgeRole::kSeed : EdgeRole::kFollower;
}

}  // namespace

swarmtalk::kilobot::Joined<swarmtalk::suite::EdgeFollowing> joined(role(), number());

int main() {
  joined.run();
}
