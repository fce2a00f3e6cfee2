#include "view/scene/swarm.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "view/swarm_json.hpp"

namespace swarmtalk::view {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Json = nlohmann::json;

const Time kStart = Time{} + seconds(1000);

DaemonStatus self_status(std::uint32_t id) {
  DaemonStatus status;
  status.node_id = id;
  return status;
}

Neighbour neighbour(std::uint32_t id, milliseconds age = milliseconds(0)) {
  Neighbour made;
  made.node_id = id;
  made.age = age;
  return made;
}

Json robot_in(const Swarm& swarm, std::uint32_t id, Time now) {
  const Json state = Json::parse(swarm_state_json(swarm, now));
  for (const Json& robot : state.at("robots")) {
    if (robot.at("id") == id) return robot;
  }
  return nullptr;
}

TEST(Swarm, WhatIsUnknownIsLeftOut) {
  Swarm swarm;
  swarm.note_self(self_status(1), kStart);
  swarm.note_neighbours({neighbour(2)}, kStart);
  const Json robot = robot_in(swarm, 2, kStart);
  EXPECT_FALSE(robot.contains("x"));
  EXPECT_FALSE(robot.contains("pose_age"));
  EXPECT_FALSE(robot.contains("told_age"));
  const Json card = Json::parse(card_json(swarm, 2, kStart));
  for (const char* key : {"distance", "bearing", "programs", "lost", "values", "address"}) {
    EXPECT_FALSE(card.contains(key)) << key;
  }
}

TEST(Swarm, AgesGrowWithTheClock) {
  Swarm swarm;
  swarm.note_self(self_status(1), kStart);
  Neighbour heard = neighbour(2, milliseconds(30));
  heard.pose = Pose{1.5f, -2.25f, 0.5f, milliseconds(40)};
  swarm.note_neighbours({heard}, kStart);
  const Json robot = robot_in(swarm, 2, kStart + milliseconds(500));
  EXPECT_EQ(robot.at("heard_age"), 530);
  EXPECT_EQ(robot.at("pose_age"), 540);
  EXPECT_DOUBLE_EQ(robot.at("x").get<double>(), 1.5);
  EXPECT_DOUBLE_EQ(robot.at("y").get<double>(), -2.25);
}

TEST(Swarm, AnOlderPlaceDoesNotReplaceANewerOne) {
  Swarm swarm;
  swarm.note_place(5, Pose{1, 1, 0, milliseconds(0)}, kStart);
  swarm.note_place(5, Pose{9, 9, 0, milliseconds(500)}, kStart + milliseconds(100));
  EXPECT_FLOAT_EQ(swarm.find(5)->place->x_m, 1);
  swarm.note_place(5, Pose{2, 2, 0, milliseconds(0)}, kStart + milliseconds(200));
  EXPECT_FLOAT_EQ(swarm.find(5)->place->x_m, 2);
}

TEST(Swarm, TheFresherOfTwoLinksTells) {
  Swarm swarm;
  swarm.note_self(self_status(1), kStart);
  Neighbour fresh = neighbour(2, milliseconds(10)), old = neighbour(2, milliseconds(4000));
  fresh.link = "wifi";
  old.link = "mesh";
  swarm.note_neighbours({fresh, old}, kStart);
  EXPECT_EQ(swarm.find(2)->link, "wifi");
}

TEST(Swarm, LossIsOfTheDirectionInWhichItWasMeasured) {
  Swarm swarm;
  swarm.note_self(self_status(1), kStart);
  Neighbour heard = neighbour(2);
  heard.loss = 0.25f;
  swarm.note_neighbours({heard}, kStart);
  const Json state = Json::parse(swarm_state_json(swarm, kStart));
  EXPECT_EQ(state.at("links"), Json::parse("[[2, 1, 0.25, 0]]"));
}

TEST(Swarm, OurOwnPoseIsUnknownAgainWhenTheDaemonSaysSo) {
  Swarm swarm;
  DaemonStatus status = self_status(1);
  status.pose = Pose{1, 2, 0, milliseconds(0)};
  swarm.note_self(status, kStart);
  EXPECT_TRUE(swarm.find(1)->place);
  swarm.note_self(self_status(1), kStart + seconds(3));
  EXPECT_FALSE(swarm.find(1)->place);
}

TEST(Swarm, AChangedNodeIdLeavesNoOldRobotBehind) {
  Swarm swarm;
  swarm.note_self(self_status(1), kStart);
  swarm.note_self(self_status(7), kStart);
  EXPECT_EQ(swarm.find(1), nullptr);
  EXPECT_EQ(swarm.self(), 7u);
}

TEST(Swarm, RobotsThatFellSilentAreForgottenAfterAWhileAndWeAreNot) {
  Swarm swarm;
  swarm.note_self(self_status(1), kStart);
  swarm.note_neighbours({neighbour(2)}, kStart);
  swarm.forget_old(kStart + Swarm::kForgetAfter);
  EXPECT_NE(swarm.find(2), nullptr);
  swarm.forget_old(kStart + Swarm::kForgetAfter + seconds(1));
  EXPECT_EQ(swarm.find(2), nullptr);
  EXPECT_NE(swarm.find(1), nullptr);
}

TEST(Swarm, TablesAreBoundedAndWhatIsLeftOutIsCounted) {
  Swarm swarm;
  for (std::uint32_t id = 1; id <= Swarm::kMostRobots + 5; ++id) {
    swarm.note_place(id, Pose{}, kStart);
  }
  EXPECT_EQ(swarm.robots().size(), Swarm::kMostRobots);
  EXPECT_EQ(swarm.left_out(), 5u);
  SwarmRobot& one = *swarm.robot(1);
  for (std::uint32_t id = 1; id <= 200; ++id) {
    swarm.note_hearing(one, id, 0, kStart + milliseconds(id));
  }
  EXPECT_EQ(one.hears.size(), Swarm::kMostHeard);
  EXPECT_TRUE(one.hears.contains(200)) << "the freshest are kept";
  for (int i = 0; i < 100; ++i) swarm.note_value(1, "key" + std::to_string(i), "v");
  EXPECT_EQ(one.values.size(), Swarm::kMostValues);
}

TEST(Swarm, AReportTellsOfARobotThatIsNotHeardWithItsAge) {
  Swarm swarm;
  swarm.note_self(self_status(1), kStart);
  report::Facts facts;
  facts.place = report::Place{-1500, 2000, 49152, 30};
  facts.hears = {{7, 51}};
  facts.lost = report::Losses{4, 0, 1, 0};
  swarm.note_report(9, facts, kStart - seconds(5));
  const Json robot = robot_in(swarm, 9, kStart);
  EXPECT_DOUBLE_EQ(robot.at("x").get<double>(), -1.5);
  EXPECT_NEAR(robot.at("th").get<double>(), -1.571, 0.001);
  EXPECT_EQ(robot.at("told_age"), 5000);
  EXPECT_EQ(robot.at("pose_age"), 5300);
  EXPECT_FALSE(robot.contains("heard_age"));
  const Json state = Json::parse(swarm_state_json(swarm, kStart));
  EXPECT_EQ(state.at("links"), Json::parse("[[7, 9, 0.2, 5000]]"));
  EXPECT_EQ(Json::parse(card_json(swarm, 9, kStart)).at("lost").at("air"), 4);
}

TEST(Swarm, AnOlderReportAndOneOfOurselvesAreLeftOut) {
  Swarm swarm;
  swarm.note_self(self_status(1), kStart);
  report::Facts facts;
  facts.lost = report::Losses{4, 0, 0, 0};
  swarm.note_report(9, facts, kStart);
  facts.lost->air = 3;
  swarm.note_report(9, facts, kStart - seconds(1));
  EXPECT_EQ(swarm.find(9)->lost->air, 4u);
  swarm.note_report(1, facts, kStart);
  EXPECT_FALSE(swarm.find(1)->told_at);
}

TEST(Swarm, TextsThatAreNotUtf8DoNotBreakTheJson) {
  Swarm swarm;
  swarm.note_value(3, "k", "\xff\xfe");
  EXPECT_TRUE(Json::accept(card_json(swarm, 3, kStart)));
}

}  // namespace
}  // namespace swarmtalk::view
