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

}  // namespace
}  // namespace swarmtalk::daemon
