// The names as Zhang et al., AAMAS 2020, print them: `swarmtalk->new_channel(...)`, `Data_t`,
// `get_clock()`, on the 9-byte packet of figure 1, so that the listings of sections 2.3 and 4
// compile.
#pragma once

#ifndef PKT_SIZE
#define PKT_SIZE 9
#endif
#ifndef WITH_CRC
#define WITH_CRC true
#endif
#include "core/classic/swarmtalk.h"

/// What a platform measures on reception; the paper leaves its fields to the platform.
typedef SwarmTalk::Meta_t Data_t;

inline unsigned int get_clock() {
  return swarmtalk_instance.sys.get_clock();
}

#undef swarmtalk
#define swarmtalk (&swarmtalk_instance)
