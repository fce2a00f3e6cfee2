// Hop count on a Kilobot. One image for the whole swarm, since one is loaded into all robots at
// once: robots with uid 1 and 2 are the seeds, all others follow. HOP_COUNT_ROLE (0 follower,
// 1 and 2 the seeds) fixes the role for robots without uids; HOP_COUNT_ONE_SEED counts from
// seed 1 alone; HOP_COUNT_CLASSIC uses the wire format of 2020.
#include "suite/programs/hop_count.hpp"

#include "platforms/kilobot/join.hpp"

namespace {

#ifdef HOP_COUNT_ONE_SEED
using swarmtalk::suite::HopCountOneSeed;
#else
using swarmtalk::suite::HopCount;
#endif
using swarmtalk::suite::HopCountRole;

HopCountRole role() {
#ifdef HOP_COUNT_ROLE
  return static_cast<HopCountRole>(HOP_COUNT_ROLE);
#else
  const uint16_t uid = swarmtalk::kilobot::read_uid();
  if (uid == 1) return HopCountRole::kSeed1;
  if (uid == 2) return HopCountRole::kSeed2;
  return HopCountRole::kFollower;
#endif
}

}  // namespace

#ifdef HOP_COUNT_CLASSIC
using Robot = swarmtalk::kilobot::ClassicKilobotRobot;
#else
using Robot = swarmtalk::kilobot::KilobotRobot;
#endif

#ifdef HOP_COUNT_ONE_SEED
swarmtalk::kilobot::Joined<HopCountOneSeed, Robot> joined(role());
#else
swarmtalk::kilobot::Joined<HopCount, Robot> joined(role());
#endif

int main() {
  SWARMTALK_KILOBOT_OFFSET(hops_1, joined, joined.program().hops(0));
#ifndef HOP_COUNT_ONE_SEED
  SWARMTALK_KILOBOT_OFFSET(hops_2, joined, joined.program().hops(1));
#endif
  joined.run();
}
