#include "daemon/common/log_limiter.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

TEST(LogLimiter, SpeaksOncePerSecondAndTellsWhatItKeptBack) {
  LogLimiter limiter;
  const LogLimiter::Time start{};
  EXPECT_EQ(limiter.pass(start), 0u);
  for (int i = 1; i < 10; ++i) {
    EXPECT_FALSE(limiter.pass(start + std::chrono::milliseconds(100 * i)));
  }
  EXPECT_EQ(limiter.pass(start + std::chrono::seconds(1)), 9u);
  EXPECT_EQ(limiter.pass(start + std::chrono::seconds(5)), 0u);
}

TEST(LogLimiter, SpeaksSomeTimesAtOnceIfSoMade) {
  LogLimiter limiter(3);
  const LogLimiter::Time start{};
  int spoken = 0;
  for (int i = 0; i < 10; ++i) spoken += limiter.pass(start) ? 1 : 0;
  EXPECT_EQ(spoken, 3);
  EXPECT_EQ(limiter.pass(start + std::chrono::seconds(1)), 7u);
}

}  // namespace
}  // namespace swarmtalk::daemon
