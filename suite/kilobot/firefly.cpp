// Firefly synchronisation on a Kilobot: one image for all robots. FIREFLY_NO_DELAY takes arrivals
// for the times of flashes, as the right half of the paper's figure 7.
#include "suite/programs/firefly.hpp"

#include "platforms/kilobot/join.hpp"

namespace {

/// 522 ms: the pace of the paper's robots (kilolib's), at which messages wait as long as there.
constexpr uint16_t kPeriod = 102 * swarmtalk::kilobot::Turns::kSlotUnits;

}  // namespace

#ifdef FIREFLY_NO_DELAY
swarmtalk::kilobot::Joined<swarmtalk::suite::FireflyNoDelay> joined;
#else
swarmtalk::kilobot::Joined<swarmtalk::suite::Firefly> joined;
#endif

int main() {
  SWARMTALK_KILOBOT_OFFSET(flash, joined, joined.program().flashes());
  joined.run(kPeriod);
}
