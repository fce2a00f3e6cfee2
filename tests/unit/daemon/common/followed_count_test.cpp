// A robot's count in virtual time; what becomes of losses is tested with LossTracker and
// Neighbours.
#include "daemon/common/followed_count.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

constexpr std::uint64_t kSecondNs = 1'000'000'000;
using Place = FollowedCount::Place;

class Followed : public testing::Test {
 protected:
  /// So many, one a tenth of a second.
  void hear(std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      now_ns_ += kSecondNs / 10;
      EXPECT_EQ(count_.heard(++number_, 0, now_ns_).believed, 0u);
    }
  }
  std::uint32_t number_ = 100;
  std::uint64_t now_ns_ = 5 * kSecondNs;
  FollowedCount count_{number_, now_ns_, true};
};

TEST_F(Followed, ShortSkipIsFollowedAtOnceAndBelievedInPart) {
  const FollowedCount::Step step = count_.heard(200, 0, now_ns_);
  EXPECT_EQ(step.place, Place::kAhead);
  EXPECT_EQ(step.distance, 100u);
  EXPECT_EQ(step.believed, FollowedCount::kBelieved);
}

TEST_F(Followed, WhatWasDoubtedIsBelievedWhenMoreIsHeard) {
  count_.heard(200, 0, now_ns_);
  number_ = 200;
  EXPECT_EQ(count_.believe_now(84), 0u) << "not at once";
  hear(100);  // 10 a second
  EXPECT_GE(count_.believe_now(84), FollowedCount::kBelieved);
}

TEST_F(Followed, LongSkipIsBelievedAfterALongSilence) {
  hear(20);
  now_ns_ += 100 * kSecondNs;
  EXPECT_EQ(count_.heard(number_ + 1001, 0, now_ns_).believed, 1000u);
}

TEST_F(Followed, LongSkipIsFollowedOnceItGoesOnThereForASecond) {
  hear(20);
  EXPECT_EQ(count_.heard(10'000, 0, now_ns_).place, Place::kDoubted);
  EXPECT_EQ(count_.heard(10'001, 0, now_ns_ + kSecondNs / 2).place, Place::kDoubted);
  const FollowedCount::Step step = count_.heard(10'002, 0, now_ns_ + kSecondNs);
  EXPECT_EQ(step.place, Place::kElsewhere);
  EXPECT_LE(step.believed, FollowedCount::kBelieved + 2 * 10 + 1);
  EXPECT_EQ(count_.heard(10'003, 0, now_ns_ + kSecondNs).distance, 1u);
}

TEST_F(Followed, LongSkipIsNotFollowedWhileTheCountGoesOnWhereItWas) {
  hear(20);
  for (std::uint32_t i = 0; i < 100; ++i) {
    EXPECT_EQ(count_.heard(10'000 + i, 0, now_ns_).place, Place::kDoubted);
    hear(1);
  }
}

TEST_F(Followed, FarBehindIsFollowedAfterTenSecondsOnly) {
  EXPECT_EQ(count_.heard(100'000, 0, now_ns_).place, Place::kDoubted);
  count_ = FollowedCount(100'000, now_ns_, true);
  EXPECT_EQ(count_.heard(5, 0, now_ns_).place, Place::kDoubted);
  EXPECT_EQ(count_.heard(6, 0, now_ns_ + 9 * kSecondNs).place, Place::kDoubted);
  const FollowedCount::Step step = count_.heard(7, 0, now_ns_ + 10 * kSecondNs);
  EXPECT_EQ(step.place, Place::kElsewhere);
  EXPECT_EQ(step.believed, 0u);
}

TEST_F(Followed, WhatTheReceiverDroppedItselfIsBelieved) {
  EXPECT_EQ(count_.heard(601, 500, now_ns_).believed, 500u);
  EXPECT_EQ(count_.heard(610, 0, now_ns_).believed, 8u) << "and nothing of the rest is used";
}

TEST_F(Followed, ToldCountsAreBelievedByWhatWasHeardAlone) {
  hear(20);
  now_ns_ += kSecondNs;
  EXPECT_EQ(count_.told(number_ + 1000, now_ns_).place, Place::kDoubted);
  const FollowedCount::Step step = count_.told(number_ + 30, now_ns_);
  EXPECT_EQ(step.place, Place::kAhead);
  EXPECT_EQ(step.believed, 30u) << "this number included";
  EXPECT_EQ(count_.told(number_ + 60, now_ns_).place, Place::kDoubted) << "not twice";
  EXPECT_EQ(count_.told(number_ + 30, now_ns_).place, Place::kBehind);
}

}  // namespace
}  // namespace swarmtalk::daemon
