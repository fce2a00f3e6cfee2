#include "view/traffic.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace swarmtalk::view {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

const Time kBegin = Time{} + seconds(1000);

Message message(std::uint16_t channel, std::uint32_t sender) {
  Message made;
  made.channel = channel;
  made.sender = sender;
  made.payload = "12345";
  return made;
}

TEST(Rate, IsTheMeanOfTheWholeSecondsBefore) {
  Rate rate;
  for (int ms = 0; ms < 5000; ms += 100) rate.count(kBegin + milliseconds(ms));
  EXPECT_DOUBLE_EQ(rate.per_second(kBegin + seconds(5)), 10.0);
}

TEST(Rate, FallsToNothingInSilence) {
  Rate rate;
  for (int i = 0; i < 50; ++i) rate.count(kBegin);
  EXPECT_DOUBLE_EQ(rate.per_second(kBegin + seconds(1)), 50.0);
  EXPECT_DOUBLE_EQ(rate.per_second(kBegin + seconds(5)), 10.0);
  EXPECT_DOUBLE_EQ(rate.per_second(kBegin + seconds(6)), 0.0);
  EXPECT_DOUBLE_EQ(rate.per_second(kBegin + seconds(1000)), 0.0);
}

TEST(Rate, OldSecondsAreForgottenWhenItGoesOn) {
  Rate rate;
  for (int i = 0; i < 50; ++i) rate.count(kBegin);
  rate.count(kBegin + seconds(100));
  EXPECT_DOUBLE_EQ(rate.per_second(kBegin + seconds(101)), 0.2);
}

TEST(Rate, IsKnownInTheFirstSecondsOfARecordingThatBeginsAtZero) {
  Rate rate;
  for (int i = 0; i < 50; ++i) rate.count(Time{} + milliseconds(20 * i));
  EXPECT_DOUBLE_EQ(rate.per_second(Time{}), 0.0);
  EXPECT_DOUBLE_EQ(rate.per_second(Time{} + seconds(1)), 50.0);
}

TEST(Rate, OfRandomHistoriesIsTheMeanOfTheSecondsBefore) {
  std::mt19937 random(1);
  for (int history = 0; history < 200; ++history) {
    Rate rate;
    std::map<int, int> counted;  // messages by second
    for (int second = 0; second < 40;
         second += random() % 4 == 0 ? static_cast<int>(random() % 8) + 1 : 1) {
      const int messages = static_cast<int>(random() % 3);
      for (int i = 0; i < messages; ++i) rate.count(kBegin + seconds(second));
      if (messages > 0) counted[second] = messages;
      for (const int later : {0, 1, 3}) {
        int sum = 0;
        for (const auto& [when, count] : counted) {
          if (when < second + later && when >= second + later - 5) sum += count;
        }
        const int since = counted.empty() ? 0 : second + later - counted.begin()->first;
        ASSERT_DOUBLE_EQ(rate.per_second(kBegin + seconds(second + later)),
                         sum / static_cast<double>(std::clamp(since, 1, 5)))
            << "history " << history << ", second " << second << " + " << later;
      }
    }
  }
}

TEST(Rate, IsNotTooLowInItsFirstSeconds) {
  Rate rate;
  for (int ms = 0; ms < 7000; ms += 100) {
    if (ms % 1000 == 0 && ms > 0) {
      EXPECT_DOUBLE_EQ(rate.per_second(kBegin + milliseconds(ms)), 10.0) << ms;
    }
    rate.count(kBegin + milliseconds(ms));
  }
}

TEST(Traffic, KnowsWhoSpeaksOnAChannel) {
  Traffic traffic;
  traffic.note_message(message(7, 3), kBegin);
  traffic.note_message(message(7, 4), kBegin);
  const ChannelTraffic& channel = traffic.channels().at(7);
  EXPECT_EQ(channel.messages, 2u);
  EXPECT_EQ(channel.bytes, 10u);
  EXPECT_EQ(channel.senders.size(), 2u);
}

TEST(Traffic, MessagesOfChannelsBeyondTheMostAreCountedAllTheSame) {
  Traffic traffic;
  for (unsigned i = 0; i < Traffic::kMostChannels + 10; ++i) {
    traffic.note_message(message(static_cast<std::uint16_t>(i), 1), kBegin);
  }
  EXPECT_EQ(traffic.channels().size(), Traffic::kMostChannels);
  EXPECT_EQ(traffic.messages(), Traffic::kMostChannels + 10);
}

TEST(Traffic, AChannelInUseTakesThePlaceOfOneThatIsSilentForLongest) {
  Traffic traffic;
  for (unsigned i = 0; i < Traffic::kMostChannels; ++i) {
    traffic.note_message(message(static_cast<std::uint16_t>(i), 1), kBegin + milliseconds(i));
  }
  DaemonStatus status;
  status.channels.resize(1);
  status.channels[0].number = 500;
  status.channels[0].subscribers = 1;
  traffic.note_status(status);
  EXPECT_EQ(traffic.channels().size(), Traffic::kMostChannels);
  EXPECT_TRUE(traffic.channels().contains(500));
  EXPECT_FALSE(traffic.channels().contains(0));
  status.channels.clear();
  traffic.note_status(status);
  EXPECT_FALSE(traffic.channels().contains(500)) << "nobody uses it, and it was never heard";
}

TEST(Traffic, KeepsTheNewestLinesAndCutsLongOnes) {
  Traffic traffic;
  for (std::size_t i = 0; i < Traffic::kMostLines + 2; ++i) traffic.note_line(1, "x", kBegin);
  EXPECT_EQ(traffic.lines().size(), Traffic::kMostLines);
  EXPECT_EQ(traffic.lines().front().number, 3u);
  EXPECT_EQ(traffic.note_line(1, std::string(5000, 'y'), kBegin).text.size(),
            Traffic::kMostLineBytes);
}

TEST(Traffic, TakesNamesAndLossesFromTheDaemon) {
  Traffic traffic;
  DaemonStatus status;
  ChannelStatus channel;
  channel.number = 7;
  channel.name = "alarm";
  channel.lost.air = 4;
  channel.publishers = 2;
  status.channels.push_back(channel);
  traffic.note_status(status);
  EXPECT_EQ(traffic.channels().at(7).name, "alarm");
  EXPECT_EQ(traffic.channels().at(7).lost.air, 4u);
  traffic.note_status(DaemonStatus{});
  EXPECT_EQ(traffic.channels().at(7).publishers, 0u);
}

}  // namespace
}  // namespace swarmtalk::view
