#include "sim/wifi_backoff.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::sim {
namespace {

constexpr WifiSpaces kSpaces{9, 34, 94};

TEST(WifiBackoff, CountsItsSlotsAfterIdleAir) {
  WifiBackoff sut;
  sut.begin(1000, kSpaces);
  EXPECT_EQ(sut.end_us(kSpaces), 1034u);
  EXPECT_TRUE(sut.is_done());
  sut.set(3);
  EXPECT_FALSE(sut.is_done());
  EXPECT_EQ(sut.end_us(kSpaces), 1034u + 27);
}

TEST(WifiBackoff, KeepsWhatItHasCountedWhenTheAirIsTaken) {
  WifiBackoff sut;
  sut.set(5);
  sut.begin(1000, kSpaces);
  sut.stop(1034 + 2 * 9 + 8, kSpaces);  // two slots and a part of the third
  sut.begin(2000, kSpaces);
  EXPECT_EQ(sut.end_us(kSpaces), 2034u + 3 * 9);
  sut.stop(2034 + 1000, kSpaces);
  EXPECT_TRUE(sut.is_done());
}

TEST(WifiBackoff, HasCountedNothingBeforeTheSpaceIsOver) {
  WifiBackoff sut;
  sut.set(2);
  sut.begin(1000, kSpaces);
  sut.stop(1033, kSpaces);
  sut.begin(2000, kSpaces);
  EXPECT_EQ(sut.end_us(kSpaces), 2034u + 18);
}

TEST(WifiBackoff, WaitsLongerAfterAFrameThatCouldNotBeRead) {
  WifiBackoff sut;
  sut.note_bad_frame(1000);
  sut.begin(1000, kSpaces);
  EXPECT_EQ(sut.end_us(kSpaces), 1094u);
  sut.begin(2000, kSpaces);
  EXPECT_EQ(sut.end_us(kSpaces), 2034u) << "that frame is long gone";
}

}  // namespace
}  // namespace swarmtalk::sim
