// What is left on the one timer of this process: that of the test's one Wakeup. It only
// shrinks, so a busy machine makes no upper bound fail.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace swarmtalk::test {

/// Whether `file`, of /proc/self/fdinfo, is of a timer; what is left on it.
inline std::optional<std::chrono::nanoseconds> left_on_timer(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  const std::string key = "it_value: (";
  while (std::getline(stream, line)) {
    if (!line.starts_with(key)) continue;
    std::istringstream numbers(line.substr(key.size()));
    std::int64_t seconds = 0, ns = 0;
    char comma = 0;
    if (!(numbers >> seconds >> comma >> ns)) return std::nullopt;
    return std::chrono::seconds(seconds) + std::chrono::nanoseconds(ns);
  }
  return std::nullopt;
}

/// What is left on the one timer of this process: that of the test's one client. proc(5)
inline std::chrono::nanoseconds left_on_the_timer() {
  std::vector<std::chrono::nanoseconds> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fdinfo")) {
    if (const auto timer = left_on_timer(entry.path())) found.push_back(*timer);
  }
  EXPECT_EQ(found.size(), 1u);
  return found.empty() ? std::chrono::nanoseconds(0) : found[0];
}

}  // namespace swarmtalk::test
