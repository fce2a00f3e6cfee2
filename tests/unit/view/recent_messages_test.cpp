#include "view/recent_messages.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace swarmtalk::view {
namespace {

HeardMessage heard(std::uint16_t channel, std::uint64_t number, std::size_t bytes) {
  HeardMessage message;
  message.channel = channel;
  message.number = number;
  message.payload = std::string(bytes, 'x');
  message.at = Time{} + std::chrono::milliseconds(number);
  return message;
}

// As many of the newest as both limits leave room for, counted anew from all that came.
TEST(RecentMessages, AreTheNewestOfEachChannelThatThereIsRoomFor) {
  std::mt19937 random(3);
  RecentMessages recent;
  std::vector<HeardMessage> all[2];
  for (std::uint64_t number = 1; number <= 4000; ++number) {
    const std::uint16_t channel = random() % 2;
    const bool is_long = number / 500 % 2 == 1;  // else the number of messages is the limit
    const HeardMessage message =
        heard(channel, number, random() % 50 == 0 ? 70'000 : random() % (is_long ? 3000 : 100));
    recent.add(message);
    all[channel].push_back(message);
    std::vector<std::uint64_t> newest;
    std::size_t bytes = 0;
    for (auto each = all[channel].rbegin(); each != all[channel].rend(); ++each) {
      bytes += each->payload.size();
      const bool is_full = newest.size() == RecentMessages::kMostOfAChannel ||
                           bytes > RecentMessages::kMostBytesOfAChannel;
      if (is_full && !newest.empty()) break;
      newest.insert(newest.begin(), each->number);
    }
    std::vector<std::uint64_t> kept;
    for (const HeardMessage& each : recent.of(channel)) kept.push_back(each.number);
    ASSERT_EQ(kept, newest);
  }
  recent.clear();
  EXPECT_TRUE(recent.of(0).empty());
}

TEST(RecentMessages, OfTooManyChannelsTheMostSilentIsForgotten) {
  RecentMessages recent;
  std::uint64_t number = 0;
  for (std::uint16_t i = 0; i < RecentMessages::kMostChannels; ++i) {
    recent.add(heard(i, ++number, 1));
  }
  recent.add(heard(0, ++number, 1));
  recent.add(heard(60000, ++number, 1));
  EXPECT_EQ(recent.of(0).size(), 2u);
  EXPECT_TRUE(recent.of(1).empty());
  EXPECT_EQ(recent.of(2).size(), 1u);
  EXPECT_EQ(recent.of(60000).size(), 1u);
}

}  // namespace
}  // namespace swarmtalk::view
