// What is told of frames that cannot be read, and how often.
#include "drivers/link/unreadable_frames.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace swarmtalk::drivers {
namespace {

using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

const MonotonicTime kUnreadableStart{seconds(1000)};

TEST(UnreadableFrames, NothingIsToldOfReadableOnesAndOfWhatIsNotOurs) {
  UnreadableFrames frames;
  LinkCounters counters;
  counters.frames_received = 9;
  counters.frames_not_ours = 9;
  EXPECT_THAT(frames.news(counters, kUnreadableStart), IsEmpty());
}

TEST(UnreadableFrames, FirstOfEachCauseIsToldAtOnceWithTheRemedy) {
  UnreadableFrames frames;
  LinkCounters counters;
  counters.frames_sealed = 1;
  EXPECT_THAT(frames.news(counters, kUnreadableStart),
              ElementsAre("1 frame was sealed with a swarm key, and this link has none; give it "
                          "the swarm's key_file, or nobody"));
  counters.frames_other_profile = 2;
  EXPECT_THAT(frames.news(counters, kUnreadableStart + seconds(1)),
              ElementsAre(StartsWith("2 frames were of another profile")));
}

TEST(UnreadableFrames, OneCauseIsToldOnceAMinuteWithTheNumberSince) {
  UnreadableFrames frames;
  LinkCounters counters;
  counters.frames_without_key = 1;
  ASSERT_EQ(frames.news(counters, kUnreadableStart).size(), 1u);
  counters.frames_without_key = 50;
  EXPECT_THAT(frames.news(counters, kUnreadableStart + seconds(59)), IsEmpty());
  EXPECT_FALSE(frames.has_news(counters));
  counters.frames_without_key = 51;
  EXPECT_TRUE(frames.has_news(counters));
  EXPECT_THAT(frames.news(counters, kUnreadableStart + seconds(61)),
              ElementsAre(StartsWith("50 frames were not sealed")));
}

TEST(UnreadableFrames, EveryCauseHasItsLine) {
  UnreadableFrames frames;
  LinkCounters counters;
  counters.frames_other_key = counters.frames_not_authentic = counters.frames_other_version = 1;
  counters.frames_tagged = 1;
  EXPECT_THAT(frames.news(counters, kUnreadableStart),
              ElementsAre(HasSubstr("another swarm key"), HasSubstr("forged"), HasSubstr("version"),
                          HasSubstr("VLAN")));
}

}  // namespace
}  // namespace swarmtalk::drivers
