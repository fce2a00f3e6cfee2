// Judge: whether what a record shows is what docs/testing.md says that a swarm promises.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/virtual/check/record.hpp"
#include "tests/virtual/check/story.hpp"

namespace swarmtalk::test {

/// In the words of docs/testing.md.
enum class Promise : std::uint8_t {
  kGenuine,
  kOnce,
  kInOrder,
  kTold,
  kAnswered,
  kRepaired,
  kKeysPart,
  kAddUp,
  kAlive,
  kWithin,
};
inline constexpr std::size_t kPromises = 10;
/// "genuine"
const char* name_of(Promise promise);

struct Violation {
  Promise promise = Promise::kGenuine;
  std::string text;  // one line
};

struct Verdict {
  std::vector<Violation> violations;
  std::array<std::uint64_t, kPromises> decided{};  // how often each could have been broken
};

Verdict judge(const Story& story, const Record& record);

}  // namespace swarmtalk::test
