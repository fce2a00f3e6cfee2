// Must not compile: IMPOSSIBLE picks a profile that cannot work. The test looks for the sentence.
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/swarmtalk.hpp"

struct Impossible : swarmtalk::core::Kilobot {
#if IMPOSSIBLE == 1
  static constexpr uint16_t kMtuBytes = 4;
#elif IMPOSSIBLE == 2
  static constexpr uint16_t kForwardSlots = 250;
#elif IMPOSSIBLE == 3
  static constexpr uint8_t kTimestampBits = 32;
  static constexpr uint16_t kMtuBytes = 8;
#endif
};

template class swarmtalk::core::Swarmtalk<Impossible>;
