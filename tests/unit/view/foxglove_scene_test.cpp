#include "view/scene/foxglove_scene.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <cmath>

#include "view/scene/foxglove.pb.h"
#include "view/scene/robots.pb.h"

namespace swarmtalk::view {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

const Time kNow = Time{} + seconds(5000);
constexpr std::uint64_t kWallNs = 1'700'000'000'250'000'000;

template <typename Proto>
Proto picture(const Swarm& swarm, Topic topic) {
  Proto message;
  const auto bytes = draw(swarm, kNow, kWallNs)[static_cast<std::size_t>(topic)];
  EXPECT_TRUE(bytes && message.ParseFromString(*bytes));
  return message;
}

Swarm two_robots() {
  Swarm swarm;
  DaemonStatus status;
  status.node_id = 1;
  status.pose = Pose{0, 0, 0, milliseconds(0)};
  swarm.note_self(status, kNow);
  Neighbour heard;
  heard.node_id = 2;
  heard.loss = 0.5f;
  heard.pose = Pose{1.5f, -0.5f, 1.0f, milliseconds(0)};
  swarm.note_neighbours({heard}, kNow);
  return swarm;
}

TEST(FoxgloveScene, ARobotIsAnArrowWhereItIsWithItsName) {
  const auto update = picture<foxglove::SceneUpdate>(two_robots(), Topic::kScene);
  const foxglove::SceneEntity& robot = update.entities(1);
  EXPECT_EQ(robot.id(), "robot/2");
  EXPECT_EQ(robot.frame_id(), "map");
  EXPECT_EQ(robot.lifetime().seconds(), 2);
  EXPECT_EQ(robot.timestamp().seconds(), 1'700'000'000);
  EXPECT_EQ(robot.timestamp().nanos(), 250'000'000);
  const foxglove::Pose& pose = robot.arrows(0).pose();
  EXPECT_DOUBLE_EQ(pose.position().x(), 1.5);
  EXPECT_DOUBLE_EQ(pose.position().y(), -0.5);
  EXPECT_NEAR(pose.orientation().z(), std::sin(0.5), 1e-6);
  EXPECT_NEAR(pose.orientation().w(), std::cos(0.5), 1e-6);
  EXPECT_EQ(robot.texts(0).text(), "2");
}

TEST(FoxgloveScene, ALinkIsTheHalfAtWhoHears) {
  const auto update = picture<foxglove::SceneUpdate>(two_robots(), Topic::kScene);
  const foxglove::LinePrimitive& lines = update.entities(2).lines(0);
  ASSERT_EQ(lines.points_size(), 2);
  EXPECT_EQ(lines.colors_size(), 2);
  EXPECT_DOUBLE_EQ(lines.points(0).x(), 0.0);
  EXPECT_DOUBLE_EQ(lines.points(1).x(), 0.75);
  EXPECT_GT(lines.colors(0).r(), lines.colors(0).b()) << "half of the frames are lost: red";
}

TEST(FoxgloveScene, WhatIsUnknownIsAbsent) {
  Swarm swarm;
  DaemonStatus status;
  status.node_id = 1;
  swarm.note_self(status, kNow);
  EXPECT_EQ(picture<foxglove::FrameTransforms>(swarm, Topic::kTransforms).transforms_size(), 0);
  const auto robots = picture<Robots>(swarm, Topic::kRobots);
  ASSERT_EQ(robots.robots_size(), 1);
  EXPECT_FALSE(robots.robots(0).has_x_m());
  EXPECT_FALSE(robots.robots(0).has_distance_m());
  EXPECT_FALSE(robots.robots(0).has_told_age_s());
}

TEST(FoxgloveScene, EachDescriptionStandsForItself) {
  for (const TopicDescription& each : topics()) {
    google::protobuf::FileDescriptorSet set;
    ASSERT_TRUE(set.ParseFromString(each.descriptor));
    google::protobuf::DescriptorPool pool;
    for (const auto& file : set.file()) ASSERT_NE(pool.BuildFile(file), nullptr) << file.name();
    EXPECT_NE(pool.FindMessageTypeByName(each.schema), nullptr) << each.schema;
  }
}

TEST(FoxgloveScene, ALineThatIsNotUtf8IsStillALog) {
  foxglove::Log log;
  ASSERT_TRUE(log.ParseFromString(encode_log({1, 7, "a\xff\n", kNow}, kWallNs)));
  EXPECT_EQ(log.message(), "a?\n");
  EXPECT_EQ(log.name(), "robot/7");
}

}  // namespace
}  // namespace swarmtalk::view
