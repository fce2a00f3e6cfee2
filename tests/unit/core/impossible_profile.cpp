// Must not compile: IMPOSSIBLE is what a profile says that cannot work. The test looks for the
// sentence. (Without it this compiles, so that the sentence is what stops it.)
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/swarmtalk.hpp"

struct Impossible : swarmtalk::core::Kilobot {
  static constexpr uint32_t kBufferBudgetBytes = 4096;
  IMPOSSIBLE
};

template class swarmtalk::core::Swarmtalk<Impossible>;
