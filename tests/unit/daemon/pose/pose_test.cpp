// Poses and what is measured with them.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "daemon/common/logging.hpp"
#include "daemon/pose/pose_keeper.hpp"
#include "daemon/pose/ranging.hpp"

namespace swarmtalk::daemon {
namespace {

using frame::FramePose;
using std::chrono::milliseconds;
constexpr double kPi = std::numbers::pi;

const PoseKeeper::Time kStart{};

NodeConfig with_limit(std::uint32_t max_age_ms) {
  NodeConfig config;
  config.pose_max_age_ms = max_age_ms;
  return config;
}

/// What the daemon logs of a pose with this theta, from a program or the pose socket.
std::string logged_of(PoseKeeper& poses, double theta_rad) {
  const auto before = spdlog::default_logger();
  testing::internal::CaptureStderr();
  start_logging("info");
  EXPECT_TRUE(poses.set(1.0, 2.0, theta_rad, kStart));
  const std::string text = testing::internal::GetCapturedStderr();
  spdlog::set_default_logger(before);
  return text;
}

TEST(PoseKeeper, KnowsNothingAtFirst) {
  const PoseKeeper poses{NodeConfig{}};
  EXPECT_FALSE(poses.valid(kStart));
  EXPECT_FALSE(poses.age_ms(kStart));
  EXPECT_FALSE(poses.on_air(kStart));
}

TEST(PoseKeeper, ConfiguredPoseNeverAges) {
  NodeConfig config;
  config.pose = FixedPose{1.0, 2.0, 0.5};
  const PoseKeeper poses(config);
  const auto later = kStart + std::chrono::hours(1000);
  ASSERT_TRUE(poses.valid(later));
  EXPECT_EQ(poses.valid(later)->age_ms, 0u);
  EXPECT_EQ(poses.on_air(later)->age_10ms, 0);
}

TEST(PoseKeeper, SetPoseGoesStaleAfterItsLimit) {
  PoseKeeper poses(with_limit(2000));
  ASSERT_TRUE(poses.set(1.0, 2.0, 0.5, kStart));
  EXPECT_EQ(poses.valid(kStart + milliseconds(2000))->age_ms, 2000u);
  EXPECT_FALSE(poses.valid(kStart + milliseconds(2001)));
  EXPECT_EQ(poses.age_ms(kStart + milliseconds(2001)), 2001u);
  EXPECT_TRUE(poses.on_air(kStart + milliseconds(2001))->is_stale());
  EXPECT_EQ(poses.on_air(kStart + milliseconds(120))->age_10ms, 12);
}

TEST(PoseKeeper, RemembersWhoToldThePoseAlsoWhenItIsTooOld) {
  PoseKeeper poses(with_limit(2000));
  ASSERT_TRUE(poses.set(1.0, 2.0, 0.5, kStart, "tracker"));
  EXPECT_FALSE(poses.valid(kStart + milliseconds(3000)));
  EXPECT_EQ(poses.told_by(), "tracker");
  EXPECT_FALSE(poses.set(1e9, 0, 0, kStart, "another"));
  EXPECT_EQ(poses.told_by(), "tracker") << "a refused pose changes nothing";
  ASSERT_TRUE(poses.set(1.0, 2.0, 0.5, std::nullopt));
  EXPECT_EQ(poses.told_by(), PoseKeeper::kConfiguration);
}

TEST(PoseKeeper, MoreThanAWholeTurnIsToldOnceSinceItMayBeDegrees) {
  PoseKeeper poses(with_limit(2000));
  for (const double theta_rad : {0.0, -2 * kPi, double{static_cast<float>(2 * kPi)}}) {
    EXPECT_EQ(logged_of(poses, theta_rad), "") << theta_rad;
  }
  const std::string text = logged_of(poses, 270);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
  EXPECT_NE(text.find("a pose has theta 270, more than a whole turn in radians"), std::string::npos)
      << text;
  EXPECT_NE(text.find("divide by 57.29578"), std::string::npos) << text;
  EXPECT_EQ(logged_of(poses, -90), "") << "told already";
}

TEST(PoseKeeper, PoseSetAsFixedDoesNotAgeUntilAnotherIsSet) {
  PoseKeeper poses(with_limit(2000));
  ASSERT_TRUE(poses.set(1.0, 2.0, 0.5, std::nullopt));
  const auto later = kStart + std::chrono::hours(1000);
  ASSERT_TRUE(poses.valid(later));
  EXPECT_EQ(poses.valid(later)->age_ms, 0u);
  ASSERT_TRUE(poses.set(1.0, 2.0, 0.5, later));
  EXPECT_FALSE(poses.valid(later + milliseconds(2001)));
}

TEST(PoseKeeper, WholeTurnsOfTheHeadingAreTakenOff) {
  PoseKeeper poses{NodeConfig{}};
  ASSERT_TRUE(poses.set(0, 0, 1000 * kPi + 0.5, kStart));
  EXPECT_NEAR(poses.valid(kStart)->theta_rad, 0.5, 1e-9);
  ASSERT_TRUE(poses.set(0, 0, -3.5, kStart));
  EXPECT_EQ(poses.valid(kStart)->theta_rad, -3.5);
  ASSERT_TRUE(poses.set(0, 0, 1e38, kStart));
  EXPECT_LE(std::abs(poses.valid(kStart)->theta_rad), 2 * kPi);
}

TEST(PoseKeeper, LimitZeroMeansNever) {
  PoseKeeper poses(with_limit(0));
  poses.set(1.0, 2.0, 0.5, kStart);
  const auto later = kStart + std::chrono::hours(10);
  ASSERT_TRUE(poses.valid(later));
  EXPECT_EQ(poses.on_air(later)->age_10ms, FramePose::kOldest);
}

TEST(PoseKeeper, ImpossiblePoseIsRefusedAndChangesNothing) {
  PoseKeeper poses{NodeConfig{}};
  poses.set(1.0, 2.0, 0.5, kStart);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(poses.set(nan, 0, 0, kStart));
  EXPECT_FALSE(poses.set(0, inf, 0, kStart));
  EXPECT_FALSE(poses.set(0, 0, nan, kStart));
  EXPECT_FALSE(poses.set(32.768, 0, 0, kStart));
  EXPECT_TRUE(poses.set(32.767, -32.767, 100.0, kStart));
}

TEST(PoseKeeper, TransmittersPoseIsUsableUpToTheLimit) {
  const PoseKeeper poses(with_limit(500));
  FramePose pose;
  pose.age_10ms = 50;
  EXPECT_TRUE(poses.is_usable(pose));
  pose.age_10ms = 51;
  EXPECT_FALSE(poses.is_usable(pose));
  EXPECT_FALSE(poses.is_usable(FramePose::stale()));
}

TEST(PoseKeeper, SaturatedAgeIsUsableUnderALongLimitOnly) {
  FramePose pose;
  pose.age_10ms = FramePose::kOldest;
  EXPECT_FALSE(PoseKeeper(with_limit(2539)).is_usable(pose));
  EXPECT_TRUE(PoseKeeper(with_limit(2540)).is_usable(pose));
  EXPECT_TRUE(PoseKeeper(with_limit(0)).is_usable(pose));
}

Range measured(OwnPose own, double x_m, double y_m) {
  return range_to(own, FramePose::from_metres(x_m, y_m, 0.0, 0.0));
}

TEST(Ranging, BearingIsCounterClockwiseFromOurHeading) {
  EXPECT_NEAR(measured({0, 0, 0}, 3, 4).distance_m, 5.0, 1e-5);
  EXPECT_NEAR(measured({0, 0, 0}, 0, 1).bearing_rad, kPi / 2, 1e-5);
  EXPECT_NEAR(measured({0, 0, 0}, 0, -1).bearing_rad, -kPi / 2, 1e-5);
  EXPECT_NEAR(measured({0, 0, kPi / 2}, 0, 1).bearing_rad, 0.0, 1e-5);
}

TEST(Ranging, BearingIsWrapped) {
  // Heading almost backwards, the other almost backwards on the far side: a small angle.
  EXPECT_NEAR(measured({0, 0, 3.0}, std::cos(-3.0), std::sin(-3.0)).bearing_rad, 2 * kPi - 6.0,
              1e-3);
  EXPECT_NEAR(measured({0, 0, 20 * kPi}, 1, 0).bearing_rad, 0.0, 1e-5);
  for (double theta = -10; theta < 10; theta += 0.1) {
    const float bearing = measured({0, 0, theta}, -1, 0.001).bearing_rad;
    EXPECT_LE(std::abs(bearing), static_cast<float>(kPi));
  }
}

TEST(Ranging, UnknownPoseGivesUnknownNotZero) {
  const FramePose there = FramePose::from_metres(1, 1, 0, 0);
  EXPECT_TRUE(std::isnan(range_to(std::nullopt, there).distance_m));
  EXPECT_TRUE(std::isnan(range_to(OwnPose{}, std::nullopt).bearing_rad));
  EXPECT_TRUE(std::isnan(range_to(OwnPose{}, FramePose::stale()).distance_m));
}

TEST(Ranging, SamePlaceHasDistanceZeroAndNoBearing) {
  const Range range = measured({1, 1, 0}, 1, 1);
  EXPECT_EQ(range.distance_m, 0.0f);
  EXPECT_TRUE(std::isnan(range.bearing_rad));
}

}  // namespace
}  // namespace swarmtalk::daemon
