// Which waits between two tries the chance of a client gives.
#include "client_lib/backoff.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/turned_clock.hpp"

namespace swarmtalk::client {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

std::vector<microseconds> waits(std::uint64_t seed) {
  test::begin(seed);
  Backoff backoff(milliseconds(20), milliseconds(250));
  std::vector<microseconds> waits;
  for (int i = 0; i < 8; ++i) waits.push_back(backoff.next());
  return waits;
}

TEST(BackoffAlone, WaitsHalfToAllOfWhatDoublesUpToTheLongest) {
  constexpr int kWholeMs[] = {20, 40, 80, 160, 250, 250, 250, 250};
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const std::vector<microseconds> seen = waits(seed);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      EXPECT_GE(seen[i], microseconds(500 * kWholeMs[i])) << "seed " << seed << ", wait " << i;
      EXPECT_LE(seen[i], microseconds(1000 * kWholeMs[i])) << "seed " << seed << ", wait " << i;
    }
  }
}

TEST(BackoffAlone, IsTheSameForTheSameSeedAndAnotherForEachClient) {
  EXPECT_EQ(waits(1), waits(1));
  EXPECT_NE(waits(1), waits(2));
  Backoff one(milliseconds(20), milliseconds(250));
  Backoff other(milliseconds(20), milliseconds(250));
  EXPECT_NE(one.next(), other.next()) << "two of one program do not return in step";
}

}  // namespace
}  // namespace swarmtalk::client
