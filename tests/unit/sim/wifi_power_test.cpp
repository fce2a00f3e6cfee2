#include "sim/wifi_power.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace swarmtalk::sim {
namespace {

Body at(double x_mm) {
  Body body;
  body.x_mm = x_mm;
  return body;
}

TEST(WifiPower, IsWhatIsNeededAtTheRangeAndFallsWithThePathExponent) {
  const WifiPower sut(WifiAirConfig{}, wifi_rates().front());
  EXPECT_DOUBLE_EQ(sut.between(at(0), at(50000)), 1);
  EXPECT_TRUE(sut.is_received(sut.between(at(0), at(50000))));
  EXPECT_FALSE(sut.is_received(sut.between(at(0), at(50001))));
  EXPECT_DOUBLE_EQ(sut.between(at(25000), at(0)), 8);
  EXPECT_NEAR(sut.margin_db(8), 9.03, 0.01);
  EXPECT_TRUE(std::isfinite(sut.between(at(0), at(0)))) << "never in the same place";
}

TEST(WifiPower, OfAFasterRateHasToBeMore) {
  const WifiRate& fastest = wifi_rates().back();
  const WifiPower sut(WifiAirConfig{}, fastest);
  const double needed = std::pow(10, fastest.more_db / 10);
  EXPECT_FALSE(sut.is_received(needed * 0.999));
  EXPECT_TRUE(sut.is_received(needed * 1.001));
  EXPECT_NEAR(sut.margin_db(needed), 0, 1e-9);
  const WifiPower slow(WifiAirConfig{}, wifi_rates().front());
  EXPECT_FALSE(sut.is_readable(2));
  EXPECT_TRUE(slow.is_readable(2));
}

TEST(WifiPower, DisturbsFartherThanItArrives) {
  const WifiPower sut(WifiAirConfig{}, wifi_rates().front());
  const double reach_mm = sut.reach_mm();
  EXPECT_GT(reach_mm, 50000);
  EXPECT_TRUE(sut.disturbs(sut.between(at(0), at(reach_mm * 0.999))));
  EXPECT_FALSE(sut.disturbs(sut.between(at(0), at(reach_mm * 1.001))));
}

TEST(WifiPower, HasItsThresholdsFromTheConfiguration) {
  WifiAirConfig config;
  config.detection_db = 10;
  config.payload_db = 20;
  config.noise_db = -10;
  config.energy_busy_db = 30;
  const WifiPower sut(config, wifi_rates().front());
  EXPECT_NEAR(sut.noise(), 0.1, 1e-12);
  EXPECT_FALSE(sut.is_detected(9.9));
  EXPECT_TRUE(sut.is_detected(10.1));
  EXPECT_FALSE(sut.is_readable(99));
  EXPECT_TRUE(sut.is_readable(101));
  EXPECT_FALSE(sut.is_busy(999));
  EXPECT_TRUE(sut.is_busy(1001));
}

}  // namespace
}  // namespace swarmtalk::sim
