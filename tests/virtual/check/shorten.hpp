// Shortens a story that breaks a promise: what happens in it without which the promise is still
// broken is left out.
#pragma once

#include <functional>

#include "tests/virtual/check/story.hpp"

namespace swarmtalk::test {

/// @param is_broken  of a story of the same robots
/// @param tries      at most so many calls of it
Story shortened(Story story, const std::function<bool(const Story&)>& is_broken, int tries);

}  // namespace swarmtalk::test
