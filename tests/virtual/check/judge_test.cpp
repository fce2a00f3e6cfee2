// The judge of stories finds each promise that is broken, and nothing in a record where all is
// well; the shortener keeps what is needed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string>

#include "tests/virtual/check/judge.hpp"
#include "tests/virtual/check/shorten.hpp"
#include "tests/virtual/check/story.hpp"

namespace swarmtalk::test {
namespace {

using Time = std::chrono::steady_clock::time_point;

/// Two robots: one sends three messages and its last word, the other hears them all.
class TwoRobots : public testing::Test {
 protected:
  TwoRobots() {
    story_.range_m = 10;
    story_.robots.resize(2);
    story_.robots[1].place = {5, 0};
    ProgramPlan mouth;
    mouth.sends = {0};
    story_.robots[0].programs = {mouth};
    ProgramPlan ear;
    ear.hears = {0};
    story_.robots[1].programs = {ear};
    Hearing hearing{2, 0, 0, 1, 2, false, true, 0, {}};
    for (int i = 0; i < 4; ++i) {
      record_.sent.push_back({1, 0, 0, 1, 1, 0, i == 3, false, {}});
      HeardMessage heard;
      heard.sent = i;
      heard.sender = 1;
      heard.epoch = 7;
      heard.number = static_cast<std::uint32_t>(i + 1);
      heard.received_at = Time(std::chrono::seconds(i));
      hearing.heard.push_back(heard);
    }
    record_.hearings = {hearing};
    record_.publishings = {{1, 0, 0, 4, 4, 0, true}};
    record_.accounts = {{1, 4, 4, 0, 0, 0, 0, 0, 0}, {2, 0, 0, 4, 4, 4, 4, 4, 4}};
    record_.uses = {{1, "waiting_messages", 20, 20}};
    record_.leftovers = {{1, 0, 4, 0, 4, 0}, {2, 0, 3, 1, 3, 1}};
  }

  std::vector<HeardMessage>& heard() { return record_.hearings[0].heard; }
  /// The promises that are broken.
  std::string broken() {
    std::string names;
    for (const Violation& each : judge(story_, record_).violations) {
      names += (names.empty() ? "" : " ") + std::string(name_of(each.promise));
    }
    return names;
  }

  Story story_;
  Record record_;
};

TEST_F(TwoRobots, KeepEveryPromise) {
  EXPECT_EQ(broken(), "");
  const Verdict verdict = judge(story_, record_);
  for (const std::uint64_t decided : verdict.decided) EXPECT_GT(decided, 0u);
}

TEST_F(TwoRobots, HearWhatNobodySent) {
  heard()[1].sent = -1;
  EXPECT_THAT(broken(), testing::StartsWith("genuine"));
}

TEST_F(TwoRobots, HearAMessageBeyondItsHopsOrOfAnotherSender) {
  heard()[1].hops = 1;
  EXPECT_EQ(broken(), "genuine");
  heard()[1].hops = 0;
  heard()[1].sender = 2;
  EXPECT_THAT(broken(), testing::HasSubstr("genuine"));
}

TEST_F(TwoRobots, HearAMessageTwice) {
  HeardMessage again = heard()[1];
  heard().insert(heard().begin() + 2, again);
  EXPECT_EQ(broken(), "once");
}

TEST_F(TwoRobots, HearAMessageAfterALaterOne) {
  std::swap(heard()[1], heard()[2]);
  EXPECT_EQ(broken(), "in-order");
}

TEST_F(TwoRobots, MayTakeAStartWithTheEpochOfTheOneBeforeForThat) {
  heard().pop_back();
  EXPECT_THAT(broken(), testing::HasSubstr("repaired"));
  record_.same_after_restart = {2};
  EXPECT_THAT(broken(), testing::HasSubstr("repaired"));
  record_.same_after_restart = {1};
  EXPECT_EQ(broken(), "");
}

TEST_F(TwoRobots, MayDropWhatWasHeardFirstForAnOlderOne) {
  heard().erase(heard().begin() + 1, heard().begin() + 3);  // 3 came, was dropped for 1, and told
  heard()[0].lost = 1;
  record_.hearings[0].is_open = false;
  EXPECT_EQ(broken(), "told") << "2 was lost before";
  record_.hearings[0].is_spared = true;
  EXPECT_EQ(broken(), "");
  heard()[0].lost = 0;
  heard()[1].lost = 1;
  EXPECT_EQ(broken(), "told") << "nothing was dropped before the first";
}

TEST_F(TwoRobots, HearAProcessAndTheNextOfItsProgramInAnyOrder) {
  std::swap(heard()[1], heard()[2]);
  record_.sent[2].process = record_.sent[3].process = 5;
  EXPECT_EQ(broken(), "");
}

TEST_F(TwoRobots, DoNotHearThemselvesButTheirFormerProcesses) {
  record_.sent.push_back({2, 0, 0, 1, 2, 0, false, false, {}});
  HeardMessage own = heard()[0];
  own.sent = 4;
  own.sender = 2;
  own.is_local = true;
  heard().push_back(own);
  EXPECT_EQ(broken(), "genuine");
  record_.sent[4].process = 3;
  EXPECT_EQ(broken(), "");
}

TEST_F(TwoRobots, MayHearAnotherOrderWhileFramesOvertakeEachOther) {
  std::swap(heard()[1], heard()[2]);
  for (HeardMessage& each : heard()) each.received_at = Time(std::chrono::seconds(10));
  Strike& fault = record_.strikes.emplace_back();
  fault.robot = 2;
  fault.begin = Time(std::chrono::seconds(8));
  fault.end = Time(std::chrono::seconds(10));
  for (const Kind kind : {Kind::kDelay, Kind::kAgain}) {
    fault.kind = kind;
    EXPECT_EQ(broken(), "");
  }
  fault.kind = Kind::kStop;
  EXPECT_EQ(broken(), "in-order");
  for (RobotPlan& each : story_.robots) each.key = 1;
  EXPECT_EQ(broken(), "") << "it may hold frames until they are proven";
  fault.robot = 1;
  EXPECT_EQ(broken(), "in-order");
  fault.kind = Kind::kDelay;
  for (HeardMessage& each : heard()) each.received_at = Time(std::chrono::seconds(11));
  EXPECT_EQ(broken(), "in-order") << "that is over";
  for (HeardMessage& each : heard()) each.received_at = {};
  EXPECT_EQ(broken(), "") << "it is not known when they came";
}

TEST_F(TwoRobots, AreToldOfEachLossAndOfNoOther) {
  heard().erase(heard().begin() + 1);
  EXPECT_THAT(broken(), testing::StartsWith("told"));
  heard()[1].lost = 1;
  EXPECT_EQ(broken(), "");
  heard()[1].lost = 2;
  EXPECT_EQ(broken(), "told");
  heard()[1].late = 1;
  EXPECT_EQ(broken(), "");
}

TEST_F(TwoRobots, MayTakeWhatWasLostBeforeTheSubscriptionFromItsOwnLosses) {
  heard().erase(heard().begin() + 2);
  heard()[2].lost = 1;
  heard()[2].late = 1;
  EXPECT_THAT(broken(), testing::StartsWith("told"));
  std::swap(heard()[2].late, heard()[0].late);
  record_.hearings[0].sent_before = 1;
  EXPECT_EQ(broken(), "") << "the first was lost to the subscription before";
  std::swap(heard()[0].late, heard()[1].late);
  EXPECT_EQ(broken(), "told") << "the second was not";
}

TEST_F(TwoRobots, MayNumberAMessageBeforeOnesThatWereSentEarlier) {
  std::swap(heard()[0].number, heard()[1].number);
  record_.hearings[0].sent_before = 1;
  EXPECT_EQ(broken(), "") << "number 2 came before the first that counts, number 1";
}

TEST_F(TwoRobots, AreToldOfNoLossOfWhatHasNotLeft) {
  record_.sent.push_back({1, 0, 0, 1, 1, 0, false, false, {}});
  record_.publishings[0].accepted = record_.publishings[0].answered = 5;
  heard()[3].lost = 1;
  EXPECT_EQ(broken(), "");
  record_.publishings[0].unsent = 1;
  EXPECT_EQ(broken(), "told");
}

TEST_F(TwoRobots, AreToldByBeaconsBeforeALaterMessage) {
  story_.robots[0].programs[0].hears = {};
  for (const bool is_flush : {true, true}) {
    record_.sent.push_back({2, 9, 0, 1, 3, 0, false, is_flush, {}});
  }
  record_.sent.push_back({1, 9, 0, 1, 4, 0, false, true, {}});  // which the neighbour hears too
  HeardMessage flush;
  flush.sender = 2;
  flush.is_local = true;
  flush.sent = 4;
  HeardMessage other = heard()[3];
  other.sent = 6;
  other.number = 4;
  heard() = {heard()[0], heard()[1], flush, other};  // 3 was lost, 4 is the neighbour's flush
  heard()[2].lost = 1;
  heard()[3].number = 4;
  record_.sent[3].is_final = false;
  EXPECT_EQ(broken(), "");
  std::swap(heard()[2].lost, heard()[3].lost);  // only the later message told it
  EXPECT_EQ(broken(), "told");
}

TEST_F(TwoRobots, MissTheLastWord) {
  heard().pop_back();
  EXPECT_EQ(broken(), "repaired");
  story_.robots[1].place = {11, 0};
  EXPECT_EQ(broken(), "") << "nobody is in reach";
  heard().push_back({3, "", 1, 7, 4, 0, false, 0, 0, {}});
  EXPECT_EQ(broken(), "repaired") << "it cannot come so far";
}

TEST_F(TwoRobots, HearEachOtherWithDifferentKeys) {
  story_.robots[1].key = 1;
  EXPECT_THAT(broken(), testing::StartsWith("keys-part"));
}

TEST_F(TwoRobots, HearEachOtherWhileOneHasAnotherKey) {
  const auto s = [](int seconds) { return Time(std::chrono::seconds(seconds)); };
  record_.key_changes = {{1, s(10), 3}, {1, s(20), 0}};
  record_.sent[1].at = s(15);
  heard()[1].received_at = s(16);
  EXPECT_EQ(broken(), "keys-part");
  heard()[1].received_at = s(21);  // it waited, and left under the old key
  EXPECT_EQ(broken(), "");
  for (const int before : {9, 10}) {  // at once: either may have been first
    record_.sent[1].at = s(before);
    heard()[1].received_at = s(16);  // sealed before
    EXPECT_EQ(broken(), "");
  }
  record_.key_changes = {{2, s(10), 3}, {2, s(20), 0}};
  EXPECT_EQ(broken(), "keys-part");
  record_.strikes = {{Kind::kStall, 2, s(15), s(20)}};
  EXPECT_EQ(broken(), "") << "it opened that when it went on";
}

TEST_F(TwoRobots, SendWhatIsNotAnsweredOrTwice) {
  record_.publishings[0].answered = 3;
  EXPECT_EQ(broken(), "answered");
  record_.publishings[0].is_open = false;  // it ended before
  EXPECT_EQ(broken(), "");
  record_.publishings[0].answered = 5;
  EXPECT_EQ(broken(), "answered");
}

TEST_F(TwoRobots, CountOtherFramesOrDeliveriesThanThereWere) {
  record_.accounts[0].told_sent = 5;
  record_.accounts[1].told_heard = 3;
  EXPECT_EQ(broken(), "add-up add-up");
  record_.accounts[0].told_sent = record_.accounts[1].told_heard = 4;
  record_.accounts[1].deliveries_ended = 3;
  EXPECT_EQ(broken(), "add-up");
}

TEST_F(TwoRobots, TakeASealedFrameTwice) {
  record_.accounts[1].different = 3;
  EXPECT_EQ(broken(), "");
  for (RobotPlan& each : story_.robots) each.key = 1;
  EXPECT_EQ(broken(), "genuine");
}

TEST_F(TwoRobots, KeepWhatShouldBeGone) {
  record_.leftovers[0].waiting_messages = 1;
  EXPECT_EQ(broken(), "alive");
  record_.leftovers[0] = {1, 0, 5, 0, 5, 0};
  EXPECT_EQ(broken(), "alive");
  record_.leftovers[0] = {1, 0, 4, 0, 5, 0};
  EXPECT_EQ(broken(), "alive");
  record_.broken.push_back("a reload was refused");
  EXPECT_EQ(broken(), "alive alive");
}

TEST_F(TwoRobots, HoldMoreThanTheyMay) {
  record_.uses = {{1, "waiting_messages", 21, 20}};
  EXPECT_EQ(broken(), "within");
}

TEST(Stories, OfOneSeedAreOne) {
  EXPECT_EQ(told(draw_story(5)), told(draw_story(5)));
  EXPECT_NE(told(draw_story(5)), told(draw_story(6)));
}

TEST(Stories, AreShortenedToWhatIsNeeded) {
  Story story = draw_story(3);
  ASSERT_GT(story.events.size(), 20u);
  story.events[7].bytes = story.events[15].bytes = 77777;
  const auto is_broken = [](const Story& without) {
    return std::count_if(without.events.begin(), without.events.end(),
                         [](const Event& each) { return each.bytes == 77777; }) == 2;
  };
  EXPECT_EQ(shortened(story, is_broken, 1000).events.size(), 2u);
  EXPECT_EQ(shortened(story, is_broken, 0).events.size(), story.events.size());
}

}  // namespace
}  // namespace swarmtalk::test
