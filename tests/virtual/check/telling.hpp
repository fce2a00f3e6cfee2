// Telling: a story as it happens, to a swarm of whole robots in virtual time.
#pragma once

#include "tests/virtual/check/record.hpp"
#include "tests/virtual/check/story.hpp"

namespace swarmtalk::test {

Record tell(const Story& story);

}  // namespace swarmtalk::test
