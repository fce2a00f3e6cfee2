#include "sim/geometry.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/body.hpp"

namespace swarmtalk::sim {
namespace {

TEST(Geometry, AgreesWithTheLibraryToABillionth) {
  for (double angle = -9; angle < 9; angle += 0.01) {
    EXPECT_NEAR(sine(angle), std::sin(angle), 1e-9);
    EXPECT_NEAR(cosine(angle), std::cos(angle), 1e-9);
    EXPECT_NEAR(angle_of(std::sin(angle) * 7, std::cos(angle) * 7),
                std::atan2(std::sin(angle), std::cos(angle)), 1e-9);
  }
  EXPECT_EQ(angle_of(0, 0), 0);
}

TEST(Body, DrivesACircleAndComesBack) {
  BodyConfig config = coachbot_body();
  config.speed_bias = config.motion_noise = 0;
  Random random(1);
  Body body(config, 0, 0, 0, random);
  body.drive(0.5, 1);
  // Turns by (1 - 0.5) * 120 / 90 rad/s: a full circle takes 9.42 s, its radius is 135 mm.
  const int steps = 9425;
  double highest = 0;
  for (int i = 0; i < steps; ++i) {
    body.advance(config, 3 * kPi / steps, random);
    highest = std::fmax(highest, body.y_mm);
  }
  EXPECT_NEAR(body.x_mm, 0, 0.1);
  EXPECT_NEAR(body.y_mm, 0, 0.1);
  EXPECT_NEAR(highest, 270, 0.1);
}

TEST(Body, IsPushedOutOfWhatItTouches) {
  Random random(1);
  Body moving(kilobot_body(), 10, 0, 0, random);
  const Body standing(kilobot_body(), 0, 0, 0, random);
  EXPECT_TRUE(push_apart(moving, standing, 33));
  EXPECT_NEAR(moving.x_mm, 33, 1e-9);
  EXPECT_FALSE(push_apart(moving, standing, 33));
}

TEST(Random, HasTheMomentsItPromises) {
  Random random(3);
  double sum = 0, squares = 0, uniform = 0;
  const int count = 200000;
  for (int i = 0; i < count; ++i) {
    const double value = random.normal();
    sum += value;
    squares += value * value;
    uniform += random.uniform();
  }
  EXPECT_NEAR(sum / count, 0, 0.01);
  EXPECT_NEAR(squares / count, 1, 0.01);
  EXPECT_NEAR(uniform / count, 0.5, 0.01);
}

}  // namespace
}  // namespace swarmtalk::sim
