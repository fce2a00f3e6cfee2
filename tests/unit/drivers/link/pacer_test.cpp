#include "drivers/link/pacer.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;
using Time = Pacer::Time;

constexpr std::uint64_t kSeed = 7;
const Time kPacerStart = Time(1000s);

/// Frames that leave in `duration` when one always waits; time stands still between them.
int frames_in(Pacer& pacer, Time from, std::chrono::nanoseconds duration) {
  int frames = 0;
  for (Time now = from;;) {
    const Pacer::Duration wait = pacer.wait(now);
    if (now + wait >= from + duration) return frames;
    now += wait;
    pacer.sent(now);
    ++frames;
  }
}

TEST(Pacer, NeverWaitsWhenUnlimited) {
  Pacer pacer(PacerConfig{}, kSeed);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(pacer.wait(kPacerStart), 0ns);
    pacer.sent(kPacerStart);
  }
}

TEST(Pacer, SpacesFramesByTheRate) {
  Pacer pacer(PacerConfig{100.0, 1, 0us, {}}, kSeed);
  EXPECT_EQ(pacer.wait(kPacerStart), 0ns);
  pacer.sent(kPacerStart);
  EXPECT_EQ(pacer.wait(kPacerStart), 10ms);
  EXPECT_EQ(pacer.wait(kPacerStart + 4ms), 6ms);
  EXPECT_EQ(pacer.wait(kPacerStart + 10ms), 0ns);
}

TEST(Pacer, HoldsTheRateOverALongTime) {
  Pacer pacer(PacerConfig{300.0, 1, 0us, {}}, kSeed);
  EXPECT_NEAR(frames_in(pacer, kPacerStart, 100s), 30000, 1);
}

TEST(Pacer, LetsABurstGoAtOnceAfterAPause) {
  Pacer pacer(PacerConfig{100.0, 5, 0us, {}}, kSeed);
  EXPECT_EQ(frames_in(pacer, kPacerStart, 1ns), 5);
  EXPECT_EQ(pacer.wait(kPacerStart), 10ms);
  EXPECT_EQ(frames_in(pacer, kPacerStart + 10s, 1ns), 5)
      << "the bucket holds no more than the burst";
}

TEST(Pacer, RefillsPartOfABurst) {
  Pacer pacer(PacerConfig{100.0, 5, 0us, {}}, kSeed);
  frames_in(pacer, kPacerStart, 1ns);
  EXPECT_EQ(frames_in(pacer, kPacerStart + 30ms, 1ns), 3);
}

TEST(Pacer, DelaysEachFrameWithinTheJitter) {
  Pacer pacer(PacerConfig{0.0, 1, 2000us, {}}, kSeed);
  Pacer::Duration least = 1h, most = 0ns;
  for (int i = 0; i < 1000; ++i) {
    const Pacer::Duration wait = pacer.wait(kPacerStart);
    least = std::min(least, wait);
    most = std::max(most, wait);
    pacer.sent(kPacerStart + wait);
  }
  EXPECT_LT(least, 100us);
  EXPECT_GT(most, 1900us);
  EXPECT_LE(most, 2000us);
}

TEST(Pacer, DrawsTheDelayOncePerFrame) {
  Pacer pacer(PacerConfig{0.0, 1, 1000000us, {}}, kSeed);
  const Pacer::Duration wait = pacer.wait(kPacerStart);
  ASSERT_GT(wait, 1ms);
  EXPECT_EQ(pacer.wait(kPacerStart + 1ms), wait - 1ms);
  EXPECT_EQ(pacer.wait(kPacerStart + wait), 0ns);
}

TEST(Pacer, KeepsTheRateWithJitter) {
  Pacer pacer(PacerConfig{100.0, 2, 3000us, {}}, kSeed);
  EXPECT_NEAR(frames_in(pacer, kPacerStart, 100s), 10000, 100);
}

TEST(Pacer, DelaysOnlyFramesOfOthersPacketsWithinTheirJitter) {
  PacerConfig config;
  config.max_forward_jitter = 2000us;
  Pacer pacer(config, kSeed);
  Pacer::Duration least = 1h, most = 0ns;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(pacer.wait(kPacerStart), 0ns) << "our own";
    pacer.sent(kPacerStart);
    const Pacer::Duration wait = pacer.wait(kPacerStart, true);
    least = std::min(least, wait);
    most = std::max(most, wait);
    pacer.sent(kPacerStart + wait);
  }
  EXPECT_LT(least, 100us);
  EXPECT_GT(most, 1900us);
  EXPECT_LE(most, 2000us);
}

TEST(Pacer, OurOwnDoesNotWaitBehindAFrameOfOthersPackets) {
  PacerConfig config;
  config.max_forward_jitter = 1s;
  Pacer pacer(config, kSeed);
  ASSERT_GT(pacer.wait(kPacerStart, true), 1ms);
  EXPECT_EQ(pacer.wait(kPacerStart + 1ms), 0ns);
}

TEST(Pacer, AFrameOfOthersPacketsWaitsForTheLargerOfTwoJitters) {
  EXPECT_FALSE(Pacer(PacerConfig{0.0, 1, 3000us, 2000us}, kSeed).tells_forwards());
  EXPECT_EQ(Pacer(PacerConfig{0.0, 1, 3000us, 2000us}, kSeed).longest_forward_jitter(), 3ms);
  EXPECT_TRUE(Pacer(PacerConfig{0.0, 1, 1000us, 2000us}, kSeed).tells_forwards());
}

TEST(Pacer, WaitsAsTheInterfaceNeedsUnlessTheConfigurationSays) {
  Pacer open(PacerConfig{}, kSeed);
  EXPECT_FALSE(open.tells_forwards());
  open.suit(true);
  EXPECT_EQ(open.longest_forward_jitter(), kForwardJitterOfRadio);
  open.suit(false);
  EXPECT_FALSE(open.tells_forwards());
  for (const auto said : {0us, 700us}) {
    Pacer fixed(PacerConfig{0.0, 1, 0us, said}, kSeed);
    fixed.suit(true);
    EXPECT_EQ(fixed.longest_forward_jitter(), said);
  }
}

TEST(Pacer, RefusesNumbersThatMeanNothing) {
  EXPECT_THROW(Pacer(PacerConfig{-1.0, 1, 0us, {}}, kSeed), std::runtime_error);
  EXPECT_THROW(Pacer(PacerConfig{0.0, 0, 0us, {}}, kSeed), std::runtime_error);
  EXPECT_THROW(Pacer(PacerConfig{0.0, 1, -1us, {}}, kSeed), std::runtime_error);
}

}  // namespace
}  // namespace swarmtalk::drivers
