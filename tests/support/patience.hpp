// How long a test waits for what has to come: far longer than it takes, and shorter than ctest's
// limit of a test (swarmtalk_test in cmake/SwarmtalkBuild.cmake).
#pragma once

#include <chrono>

namespace swarmtalk::test {

constexpr std::chrono::minutes kPatience{1};

}  // namespace swarmtalk::test
