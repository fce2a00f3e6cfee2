#include "daemon/common/token_bucket.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

constexpr std::uint64_t kSecond = 1'000'000'000;

int take_all(TokenBucket& bucket, std::uint64_t now_ns) {
  int taken = 0;
  while (taken < 1000 && bucket.take(now_ns)) ++taken;
  return taken;
}

TEST(TokenBucket, LetsABurstThroughAndThenTheRate) {
  TokenBucket bucket(10, 5);
  EXPECT_EQ(take_all(bucket, 100 * kSecond), 5);
  EXPECT_EQ(take_all(bucket, 100 * kSecond + kSecond / 10 - 1), 0);
  EXPECT_EQ(take_all(bucket, 100 * kSecond + kSecond / 10), 1);
  EXPECT_EQ(take_all(bucket, 200 * kSecond), 5);
}

TEST(TokenBucket, WithoutARateLetsEverythingThrough) {
  TokenBucket bucket(0, 1);
  EXPECT_EQ(take_all(bucket, 1), 1000);
}

}  // namespace
}  // namespace swarmtalk::daemon
