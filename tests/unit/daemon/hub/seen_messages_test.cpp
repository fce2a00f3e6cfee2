#include "daemon/hub/seen_messages.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

using namespace std::chrono_literals;

const std::vector<std::uint8_t> kPayload{1, 2, 3};
const SeenMessages::Time kFirst{1000s};

SeenMessages::Identity message(std::uint32_t number, std::uint16_t epoch = 7) {
  return {9, epoch, number, 3, kPayload};
}

TEST(SeenMessages, KnowsTheSecondWayOfAMessage) {
  SeenMessages seen;
  EXPECT_FALSE(seen.came_otherwise(message(1), {0, 9}, kFirst));
  EXPECT_TRUE(seen.came_otherwise(message(1), {1, 9}, kFirst + 1s)) << "another link";
  EXPECT_TRUE(seen.came_otherwise(message(1), {0, 8}, kFirst + 1s)) << "another sender";
  EXPECT_FALSE(seen.came_otherwise(message(1), {0, 9}, kFirst + 1s)) << "the same way";
  EXPECT_FALSE(seen.came_otherwise(message(2), {1, 9}, kFirst + 1s)) << "another message";
}

TEST(SeenMessages, ForgetsSoonerWhereNumbersComeBack) {
  SeenMessages seen;
  seen.came_otherwise(message(1, 0), {0, 9}, kFirst);
  seen.came_otherwise(message(1, 7), {0, 9}, kFirst);
  EXPECT_FALSE(seen.came_otherwise(message(1, 0), {1, 9}, kFirst + 3s));
  EXPECT_TRUE(seen.came_otherwise(message(1, 7), {1, 9}, kFirst + 3s));
  EXPECT_FALSE(seen.came_otherwise(message(1, 7), {1, 9}, kFirst + 11s));
}

TEST(SeenMessages, OtherBytesAreAnotherMessage) {
  SeenMessages seen;
  seen.came_otherwise(message(1), {0, 9}, kFirst);
  const std::vector<std::uint8_t> other{1, 2, 4};
  EXPECT_FALSE(seen.came_otherwise({9, 7, 1, 3, other}, {1, 9}, kFirst));
}

TEST(SeenMessages, ForgetsTheOldestBeyondItsLimit) {
  SeenMessages seen;
  for (std::uint32_t i = 0; i <= SeenMessages::kMost; ++i) {
    seen.came_otherwise(message(i), {0, 9}, kFirst);
  }
  EXPECT_FALSE(seen.came_otherwise(message(0), {1, 9}, kFirst)) << "forgotten";
  EXPECT_TRUE(seen.came_otherwise(message(SeenMessages::kMost), {1, 9}, kFirst));
}

}  // namespace
}  // namespace swarmtalk::daemon
