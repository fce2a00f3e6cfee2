#include "drivers/link/airtime.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::drivers {
namespace {

TEST(Airtime, OfUsualFrames) {
  EXPECT_NEAR(airtime_us(1, 64, 1.0), 552 + 800, 1);
  EXPECT_NEAR(airtime_us(1, 1024, 11.0), 552 + 771, 1);
  EXPECT_NEAR(airtime_us(1, 64, 6.0), 125.5 + 133, 1);
  EXPECT_NEAR(airtime_us(1, 1024, 24.0), 125.5 + 353, 1);
}

TEST(Airtime, OneFrameWithManyPacketsCostsLessThanManyFrames) {
  EXPECT_LT(airtime_us(1, 640, 6.0), airtime_us(10, 640, 6.0) / 2);
}

LinkCounters counted(std::uint64_t frames, std::uint64_t bytes) {
  LinkCounters counters;
  counters.frames_sent = counters.frames_received = frames;
  counters.bytes_sent = counters.bytes_received = bytes;
  return counters;
}

TEST(AirtimeMeter, GuessesNothingWithoutARate) {
  AirtimeMeter meter(0);
  LinkCounters counters = counted(10, 1000);
  meter.fill(counters);
  EXPECT_EQ(counters.airtime_us_sent, 0u);
}

TEST(AirtimeMeter, CountsFromTheTimeThatTheRateIsKnown) {
  AirtimeMeter meter(0);
  meter.set_rate(1.0, counted(10, 1000));
  LinkCounters counters = counted(12, 1128);
  meter.fill(counters);
  EXPECT_EQ(counters.airtime_us_sent, 2 * 1352u);
  EXPECT_EQ(counters.airtime_us_received, 2 * 1352u);
}

TEST(AirtimeMeter, KeepsWhatItCountedWhenTheRateChanges) {
  AirtimeMeter meter(0);
  meter.set_rate(1.0, counted(0, 0));
  meter.set_rate(0.0, counted(2, 128));
  LinkCounters counters = counted(100, 6400);
  meter.fill(counters);
  EXPECT_EQ(counters.airtime_us_sent, 2 * 1352u);
}

TEST(AirtimeMeter, CountsWhatWasSentAndWhatWasReceivedEachByItself) {
  AirtimeMeter meter(0);
  meter.set_rate(1.0, {});
  LinkCounters counters;
  counters.frames_sent = 1;
  counters.bytes_sent = 64;
  counters.frames_received = 3;
  counters.bytes_received = 3 * 64;
  for (const double rate : {6.0, 6.0, 0.0}) {
    meter.set_rate(rate, counters);
    meter.fill(counters);
    EXPECT_EQ(counters.airtime_us_sent, 1352u);
    EXPECT_EQ(counters.airtime_us_received, 3 * 1352u);
  }
  meter.set_rate(1.0, counters);
  counters.frames_received += 1;
  counters.bytes_received += 64;
  meter.fill(counters);
  EXPECT_EQ(counters.airtime_us_sent, 1352u);
  EXPECT_EQ(counters.airtime_us_received, 4 * 1352u);
}

TEST(AirtimeMeter, CountsHeadersOfTheNetwork) {
  AirtimeMeter meter(28);
  meter.set_rate(1.0, counted(0, 0));
  LinkCounters counters = counted(1, 64);
  meter.fill(counters);
  EXPECT_EQ(counters.airtime_us_sent, 1352u + 28 * 8);
}

}  // namespace
}  // namespace swarmtalk::drivers
