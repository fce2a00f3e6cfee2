// What is asked of the swarm, and what is taken from the channels debug and harvest.
#include "view/reports.hpp"

#include <gtest/gtest.h>

#include "report/harvest_text.hpp"
#include "report/report.hpp"
#include "tests/unit/view/told_source.hpp"

namespace swarmtalk::view {
namespace {

using std::chrono::milliseconds;

std::vector<std::uint16_t> asked(Reports& reports) {
  const auto look = report::decode_look(reports.look());
  EXPECT_TRUE(look && look->seconds == Reports::kLookSeconds);
  return look ? look->wanted : std::vector<std::uint16_t>();
}

TEST(Reports, AskForDetailsOfTheFewThatWereWantedLast) {
  using Robots = std::vector<std::uint16_t>;
  Reports reports;
  EXPECT_FALSE(reports.has_new_wish());
  EXPECT_EQ(asked(reports), Robots());
  for (const std::uint32_t robot : {7u, 65535u, 7u, 0u, 65536u}) reports.want(robot);
  EXPECT_TRUE(reports.has_new_wish());
  EXPECT_EQ(asked(reports), (Robots{7, 65535}));
  EXPECT_FALSE(reports.has_new_wish());
  reports.want(7);
  EXPECT_FALSE(reports.has_new_wish()) << "is asked for already";
  for (const std::uint32_t robot : {1u, 2u, 3u}) reports.want(robot);
  EXPECT_TRUE(reports.has_new_wish());
  EXPECT_EQ(asked(reports), (Robots{65535, 1, 2, 3}));
}

Message harvest(const std::string& payload) {
  Message message;
  message.sender = 9;
  message.payload = payload;
  return message;
}

TEST(Reports, OfSeveralRobotsAreTakenWithTheirAges) {
  ToldSource source;
  report::Report report;
  report::Facts facts;
  facts.name = "left";
  report.records.push_back({2, 4, report::encode_body(facts)});
  facts.name = "right";
  report.records.push_back({3, 0, report::encode_body(facts)});
  report.records.push_back({4, 0, "\xFF\xFF nothing that can be read"});
  source.take_harvest(harvest(report::encode(report)), kToldSourceNow);
  const SwarmRobot* const left = source.swarm().find(2);
  ASSERT_TRUE(left != nullptr);
  EXPECT_EQ(left->name, "left");
  EXPECT_EQ(left->told_at, kToldSourceNow - milliseconds(1000));
  const SwarmRobot* const right = source.swarm().find(3);
  ASSERT_TRUE(right != nullptr);
  EXPECT_EQ(right->name, "right");
  EXPECT_EQ(right->told_at, kToldSourceNow);
  EXPECT_EQ(source.swarm().find(9), nullptr) << "carried it, and is not in it";
}

TEST(Reports, ValuesOfProgramsAreTheirSenders) {
  ToldSource source;
  std::string answer = report::begin_answer(1);
  report::append_value(answer, "led", "#ff8000");
  report::append_value(answer, std::string(65, 'k'), std::string(513, 'v'));
  source.take_harvest(harvest(answer), kToldSourceNow);
  const SwarmRobot* const robot = source.swarm().find(9);
  ASSERT_TRUE(robot != nullptr);
  using Values = std::map<std::string, std::string>;
  EXPECT_EQ(robot->values,
            (Values{{"led", "#ff8000"}, {std::string(64, 'k'), std::string(512, 'v')}}));
}

TEST(SourceOfMessages, NotesTheSendersPlaceOnlyOfWhatItHeardFromItself) {
  ToldSource source;
  std::vector<HeardMessage> heard;
  source.on_message = [&](const HeardMessage& message) { heard.push_back(message); };
  Message message;
  message.channel = 6;
  message.sender = 2;
  message.payload = "hello";
  message.hops = 0;
  message.distance_m = 1.5F;
  message.bearing_rad = 0.25F;
  message.lost_before.air = 4;
  message.sender_pose = Pose{1, 2, 3, milliseconds(40)};
  const auto place = [&](const Message& each) {
    source.take_message(each, kToldSourceNow, 11);
    const SwarmRobot* const robot = source.swarm().find(each.sender);
    return robot != nullptr && robot->place ? robot->place->x_m : 0;
  };
  EXPECT_EQ(place(message), 1);
  ASSERT_EQ(heard.size(), 1u);
  EXPECT_EQ(heard[0].number, 1u);
  EXPECT_EQ(heard[0].channel, 6);
  EXPECT_EQ(heard[0].sender, 2u);
  EXPECT_EQ(heard[0].hops, 0u);
  EXPECT_FALSE(heard[0].is_local);
  EXPECT_EQ(heard[0].distance_m, 1.5F);
  EXPECT_EQ(heard[0].bearing_rad, 0.25F);
  EXPECT_EQ(heard[0].lost_before.air, 4u);
  EXPECT_EQ(heard[0].payload, "hello");
  EXPECT_EQ(heard[0].at, kToldSourceNow);
  EXPECT_EQ(heard[0].unknown_bytes, 11u);
  Message forwarded = message;
  forwarded.sender = 3;
  forwarded.hops = 1;
  EXPECT_EQ(place(forwarded), 0);
  Message own = message;
  own.sender = 4;
  own.local = true;
  EXPECT_EQ(place(own), 0);
  Message carried = message;
  carried.sender = 5;
  carried.origin.emplace();
  EXPECT_EQ(place(carried), 0);
  Message unplaced = message;
  unplaced.sender = 6;
  unplaced.sender_pose.reset();
  EXPECT_EQ(place(unplaced), 0);
  ASSERT_EQ(heard.size(), 5u);
  EXPECT_EQ(heard[4].number, 5u);
  EXPECT_TRUE(heard[2].is_local);
}

TEST(SourceOfMessages, ChannelsAreCalledByNumbersUpTo65535) {
  for (const char* const number : {"0", "7", "007", "65535", "00001"}) {
    EXPECT_TRUE(is_channel_number(number)) << number;
  }
  for (const char* const name : {"", "65536", "000001", "7a", "-1", "+1", " 1"}) {
    EXPECT_FALSE(is_channel_number(name)) << name;
  }
}

}  // namespace
}  // namespace swarmtalk::view
