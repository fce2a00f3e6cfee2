#include "daemon/config/memory_need.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

namespace swarmtalk::daemon {
namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

std::uint64_t memory_of_the_unit() {
  const std::string key = "MemoryMax=";
  std::ifstream unit(SWARMTALK_UNIT);
  for (std::string line; std::getline(unit, line);) {
    if (line.starts_with(key) && line.back() == 'M') {
      return std::stoull(line.substr(key.size())) * kMiB;
    }
  }
  return 0;
}

TEST(MemoryNeed, OfAllDefaultsTogetherIsLessThanTheUnitsLimit) {
  Config config;
  config.links.resize(3);
  ASSERT_GT(memory_of_the_unit(), 0u);
  EXPECT_LT(most_memory_bytes(config), memory_of_the_unit());
  EXPECT_FALSE(memory_problem(config, memory_of_the_unit()));
}

TEST(MemoryNeed, GrowsWithWhatEachClientMayHold) {
  Config config;
  const std::uint64_t before = most_memory_bytes(config);
  config.limits.queue_bytes *= 2;
  EXPECT_GT(most_memory_bytes(config), before + 64 * kMiB);
}

TEST(MemoryNeed, TooLittleIsToldInOneLineWithTheRemedy) {
  const auto problem = memory_problem(Config{}, 32 * kMiB);
  ASSERT_TRUE(problem);
  EXPECT_NE(problem->find("more than the 32 MiB"), std::string::npos) << *problem;
  EXPECT_NE(problem->find("raise MemoryMax="), std::string::npos);
  EXPECT_EQ(problem->find('\n'), std::string::npos);
}

}  // namespace
}  // namespace swarmtalk::daemon
