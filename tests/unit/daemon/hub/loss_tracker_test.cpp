#include "daemon/hub/loss_tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace swarmtalk::daemon {
namespace {

constexpr LossTracker::Source kSource{7, 3, 1};
constexpr std::uint64_t kSecondNs = 1'000'000'000;

class Tracker : public testing::Test {
 protected:
  Loss note(std::uint32_t number, DropTotals drops = {}) {
    return tracker_.note(kSource, number, drops, now_ns_);
  }
  Loss note_last(std::uint32_t number, DropTotals drops = {}) {
    return tracker_.note_last(kSource, number, drops, now_ns_);
  }
  /// All from one number to another, without loss.
  void hear(std::uint32_t from, std::uint32_t to, std::uint32_t rate_hz) {
    for (std::uint32_t number = from; number <= to; ++number) {
      note(number);
      now_ns_ += kSecondNs / rate_hz;
    }
  }
  LossTracker tracker_{4};
  std::uint64_t now_ns_ = 1;
};

TEST_F(Tracker, FirstMessageOfASourceFindsNothing) {
  EXPECT_EQ(note(1000), Loss{});
}

TEST_F(Tracker, PutsAnUnexplainedGapDownToTheAir) {
  note(1);
  EXPECT_EQ(note(2), Loss{});
  EXPECT_EQ(note(6).air, 3u);
}

TEST_F(Tracker, BeaconTellsOfMessagesThatNoOtherFollowed) {
  note(1);
  EXPECT_EQ(note_last(1), Loss{});
  EXPECT_EQ(note_last(4).air, 3u);
  EXPECT_EQ(note_last(4), Loss{}) << "once";
  EXPECT_EQ(note(5), Loss{}) << "nor again by the next message";
  EXPECT_EQ(note(7).air, 1u);
}

TEST_F(Tracker, MessageThatABeaconCountedAsLostMayComeLate) {
  note(1);
  EXPECT_EQ(note_last(3).air, 2u);
  EXPECT_EQ(note(3).late, 1u);
  EXPECT_EQ(note(3).late, 0u);
  EXPECT_EQ(note(2).late, 1u);
  EXPECT_EQ(note_last(5).air, 2u);
  EXPECT_EQ(note(6), Loss{});
  EXPECT_EQ(note(5).late, 1u);
  EXPECT_EQ(note(4).late, 1u);
}

/// Over another robot, which stood still for a while, messages come after what beacons say of them.
TEST_F(Tracker, WhatBeaconsCountedAsLostIsCountedAgainFromTheFirstMessageOn) {
  EXPECT_EQ(note_last(1), Loss{});
  EXPECT_EQ(note_last(5).air, 4u);
  EXPECT_EQ(note(3).late, 3u) << "3 has come, and of 4 and 5 it counts again";
  EXPECT_EQ(note(5).air, 1u);
  EXPECT_EQ(note(2).late, 1u);
  EXPECT_EQ(note(4).late, 1u);
  EXPECT_EQ(note_last(5), Loss{});
}

TEST_F(Tracker, FarBelowWhatBeaconsSayAllOfThemWasToldInVain) {
  note_last(1000);
  EXPECT_EQ(note_last(1010).air, 10u);
  EXPECT_EQ(note(7).late, 10u);
  EXPECT_EQ(note(9).air, 1u);
}

/// As many as a source of this rate is believed to have lost in so long.
constexpr std::uint64_t most_of(double hz, double seconds) {
  return static_cast<std::uint64_t>(LossTracker::kBelieved + 2 * hz * seconds + 1);
}

TEST_F(Tracker, BeaconThatTellsOfMoreThanItsSenderCanHaveSentFindsNothing) {
  for (std::uint32_t number = 1; number <= 100; ++number) {  // 50 a second
    note(number);
    now_ns_ += kSecondNs / 50;
  }
  for (std::uint32_t i = 1; i <= 1000; ++i) EXPECT_EQ(note_last(100 + i * 9000), Loss{});
  EXPECT_EQ(tracker_.disbelieved(), 1000u);
  EXPECT_EQ(note(103).air, 2u) << "and the count has not moved";
}

TEST_F(Tracker, ForgedBeaconsTogetherTellNoMoreThanCanHaveBeenMissed) {
  for (std::uint32_t number = 1; number <= 100; ++number) {
    note(number);
    now_ns_ += kSecondNs / 50;
  }
  Loss told;
  for (std::uint32_t number = 101; number <= 5000; ++number) {
    now_ns_ += kSecondNs / 4900;
    told += note_last(number);
  }
  EXPECT_LE(told.air, LossTracker::kBelieved + 2u * 51u);
}

TEST_F(Tracker, BeaconAfterALongSilenceIsBelieved) {
  for (std::uint32_t number = 1; number <= 100; ++number) {
    note(number);
    now_ns_ += kSecondNs / 50;
  }
  now_ns_ += 60 * kSecondNs;
  EXPECT_EQ(note_last(3100).air, 3000u);
}

TEST_F(Tracker, BeaconAfterABurstIsBelieved) {
  for (std::uint32_t number = 1; number <= 50; ++number) {
    note(number);
    now_ns_ += kSecondNs / 1000;
  }
  now_ns_ += kSecondNs;
  EXPECT_EQ(note_last(500).air, 450u);
}

TEST_F(Tracker, ForgedBeaconBeforeTheFirstMessageHidesNoLoss) {
  note_last(1'000'000);
  EXPECT_EQ(note(1), Loss{});
  EXPECT_EQ(note(4).air, 2u);
}

TEST_F(Tracker, BeaconThatWasOvertakenFindsNothing) {
  note(9);
  EXPECT_EQ(note_last(8), Loss{});
  EXPECT_EQ(note(10), Loss{});
}

TEST_F(Tracker, FirstBeaconOfASourceIsWhereCountingBegins) {
  EXPECT_EQ(note_last(9), Loss{});
  EXPECT_EQ(note(12).air, 2u);
}

TEST_F(Tracker, BeaconPutsLossDownToTheKernelToo) {
  note(1, {5, 0});
  EXPECT_EQ(note_last(3, {6, 0}), (Loss{.air = 1, .kernel = 1}));
}

TEST_F(Tracker, DoesNotBlameDropsFromBeforeABeaconForAGapAfterIt) {
  note(1);
  EXPECT_EQ(note_last(2, {5, 0}).kernel, 1u);
  const Loss later = note(6, {5, 0});
  EXPECT_EQ(later.kernel, 0u);
  EXPECT_EQ(later.air, 3u);
}

TEST_F(Tracker, CountsAcrossTheWrapOfNumbers) {
  note(0xFFFFFFFE);
  EXPECT_EQ(note(1).air, 2u);
}

TEST_F(Tracker, PutsAGapDownToTheKernelAsFarAsItDropped) {
  note(1, {5, 0});
  const Loss loss = note(6, {7, 0});
  EXPECT_EQ(loss.kernel, 2u);
  EXPECT_EQ(loss.air, 2u);
}

TEST_F(Tracker, PutsOneDropDownToOneGapOnly) {
  const LossTracker::Source other{7, 4, 1};
  note(1);
  tracker_.note(other, 1, {}, now_ns_);
  EXPECT_EQ(note(3, {1, 0}).kernel, 1u);
  EXPECT_EQ(tracker_.note(other, 3, {1, 0}, now_ns_).air, 1u);
}

TEST_F(Tracker, DoesNotBlameDropsFromBeforeTheGap) {
  note(1, {0, 0});
  note(2, {9, 0});  // the nine were of others
  EXPECT_EQ(note(4, {9, 0}).air, 1u);
}

TEST_F(Tracker, PutsTheRestOfAGapDownToMemory) {
  note(1);
  const Loss loss = note(10, {3, 4});
  EXPECT_EQ(loss.kernel, 3u);
  EXPECT_EQ(loss.daemon, 4u);
  EXPECT_EQ(loss.air, 1u);
}

TEST_F(Tracker, TellsAMessageThatCameLateOnce) {
  note(1);
  EXPECT_EQ(note(4).air, 2u);
  EXPECT_EQ(note(3).late, 1u);
  EXPECT_EQ(note(3).late, 0u);
  EXPECT_EQ(note(4), Loss{});
  EXPECT_EQ(note(5), Loss{});
}

TEST_F(Tracker, DoesNotTakeANumberFromBeforeTheFirstForLate) {
  note(10);
  EXPECT_EQ(note(9), Loss{});
}

TEST_F(Tracker, FollowsASenderWhoseCountGoesOnElsewhere) {
  note(5);
  EXPECT_EQ(note(0x80000000), Loss{});
  now_ns_ += kSecondNs;
  Loss told = note(0x80000001);
  for (std::uint32_t number = 0x80000003; number < 0x80000013; ++number) told += note(number);
  EXPECT_GE(told.air, 1u);
  EXPECT_LE(told.air, most_of(160, 1.0));
}

TEST_F(Tracker, FollowsASenderWhoseCountFellBack) {
  note(1'000'000);
  EXPECT_EQ(note(5), Loss{});
  now_ns_ += 10 * kSecondNs;
  EXPECT_EQ(note(6), Loss{});
  EXPECT_EQ(note(8).air, 1u);
}

// Whoever makes up messages under a robot's name can tell no more than could have been missed.

TEST_F(Tracker, MadeUpMessageFarAheadTellsNothingWhileItsSenderIsHeard) {
  hear(1, 100, 50);
  for (std::uint32_t i = 1; i <= 50; ++i) {
    EXPECT_EQ(note(100 + i * 9000), Loss{});
    EXPECT_EQ(note(100 + i), Loss{}) << "and the count has not moved";
    now_ns_ += kSecondNs / 50;
  }
  EXPECT_EQ(tracker_.doubted(), 50u);
  EXPECT_EQ(note(153).air, 2u);
}

TEST_F(Tracker, MadeUpMessagesAloneTellWhatCanHaveBeenMissed) {
  hear(1, 100, 50);
  Loss told;
  for (std::uint32_t i = 1; i <= 10; ++i) {  // one a second
    now_ns_ += kSecondNs;
    told += note(100 + i * 9000);
  }
  EXPECT_LE(told.air, most_of(51, 10.1));
}

TEST_F(Tracker, MadeUpMessagesALittleAheadTellAFewAndTheseComeLate) {
  hear(1, 100, 50);
  Loss told;
  std::uint32_t number = 101;
  for (std::uint32_t i = 0; i < 50; ++i, ++number) {
    told += note(number);
    if (i % 5 == 0) told += note(number + 200);
    now_ns_ += kSecondNs / 50;
  }
  EXPECT_LE(told.air, most_of(60 * FollowedCount::kMostSteps, 1.1));
  for (; number < 500; ++number, now_ns_ += kSecondNs / 50) told += note(number);
  EXPECT_LE(told.air - told.late, LossTracker::kBelieved);
}

TEST_F(Tracker, ManyMadeUpMessagesAtOnceTellNoMore) {
  hear(1, 100, 50);
  Loss told;
  for (std::uint32_t i = 1; i <= 1000; ++i) told += note(100 + 200 * i);
  EXPECT_LE(told.air, 1000 * 2 * FollowedCount::kMostSteps) << "of 199,000 passed over";
}

TEST_F(Tracker, MadeUpMessageOfTheFarEndIsNotFollowed) {
  hear(1, 100, 50);
  EXPECT_EQ(note(0x80000000), Loss{});
  EXPECT_EQ(note(103).air, 2u);
}

TEST_F(Tracker, MessageAfterAMadeUpBeaconThatCameFirstTellsNothing) {
  note_last(1);
  EXPECT_EQ(note(5000), Loss{});
  EXPECT_EQ(note(5002).air, 1u);
}

// And whoever is honest is counted exactly.

TEST_F(Tracker, CountsAllOfAFrameThatIsLostAtTheBeginningOfABurst) {
  Loss told = note(1);
  for (std::uint32_t number = 62; number <= 121; ++number) told += note(number);
  EXPECT_EQ(told.air, 60u);
}

TEST_F(Tracker, CountsAllWhileNineOfTenAreLost) {
  Loss told;
  for (std::uint32_t number = 1; number <= 10'001; number += 10) {
    told += note(number);
    now_ns_ += kSecondNs / 5;
  }
  EXPECT_EQ(told.air, 9000u);
}

TEST_F(Tracker, CountsAllAfterALongSilence) {
  hear(1, 100, 50);
  now_ns_ += 3600 * kSecondNs;
  EXPECT_EQ(note(180'001).air, 179'900u);
}

TEST_F(Tracker, CountsAllThatTheReceiverDroppedInABurst) {
  hear(1, 2, 1);
  EXPECT_EQ(note(1003, {1000, 0}), (Loss{.kernel = 1000}));
}

TEST_F(Tracker, CountsWhatAFasterSenderLostOnceItIsHeardForASecond) {
  hear(1, 100, 1);
  Loss told;
  for (std::uint32_t number = 700; number <= 1000; ++number) {
    told += note(number);
    now_ns_ += kSecondNs / 200;
  }
  EXPECT_EQ(told.air, 599u);
}

TEST_F(Tracker, ForgetsTheLongestUnheardWhenFull) {
  for (std::uint16_t sender = 1; sender <= 5; ++sender)
    tracker_.note({7, sender, 1}, 1, {}, now_ns_);
  EXPECT_EQ(tracker_.size(), 4u);
  EXPECT_EQ(tracker_.evicted(), 1u);
  EXPECT_EQ(tracker_.note({7, 1, 1}, 9, {}, now_ns_), Loss{});
  EXPECT_EQ(tracker_.note({7, 5, 1}, 3, {}, now_ns_).air, 1u);
}

TEST_F(Tracker, CountsNothingWhileNobodySubscribes) {
  note(1);
  tracker_.forget(7);
  EXPECT_EQ(note(9), Loss{});
}

TEST_F(Tracker, ReceivedAndLostAddUpInAnyOrder) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    LossTracker tracker(1);
    std::mt19937 random(seed);
    std::vector<std::uint32_t> numbers;
    for (std::uint32_t i = 2; i < 3000; ++i) {
      if (random() % 4 != 0) numbers.push_back(i);
    }
    for (auto block = numbers.begin(); numbers.end() - block >= 50; block += 50) {
      std::shuffle(block, block + 50, random);
    }
    numbers.insert(numbers.begin(), 1);
    numbers.push_back(3000);
    Loss sum;
    for (const std::uint32_t number : numbers) sum += tracker.note(kSource, number, {}, 1);
    EXPECT_EQ(numbers.size() + sum.air - sum.late, 3000u) << "seed " << seed;
  }
}

}  // namespace
}  // namespace swarmtalk::daemon
