// Each text for the page in whole: every field has another value, so that none can stand in
// another's place, be told in another unit or be left out.
#include "view/swarm_json.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/unit/view/told_source.hpp"

namespace swarmtalk::view {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Json = nlohmann::json;

const Time kLooked = kToldSourceNow;
const Time kTold = kLooked - milliseconds(300);

Neighbour neighbour() {
  Neighbour made;
  made.link = "wifi";
  made.node_id = 2;
  made.epoch = 77;
  made.address = "02:00:00:00:00:02";
  made.age = milliseconds(20);
  made.distance_m = 1.25f;
  made.bearing_rad = -0.5f;
  made.pose = Pose{3.5f, -4.25f, 0.75f, milliseconds(40)};
  made.frames = 900;
  made.frames_lost = 11;
  made.loss = 0.125f;
  made.duplicate_id = true;
  made.is_ghost = true;
  return made;
}

void fill(Swarm& swarm) {
  DaemonStatus own;
  own.node_id = 1;
  own.pose = Pose{0.5f, 0.625f, -1.5f, milliseconds(30)};
  swarm.note_self(own, kTold);
  swarm.note_neighbours({neighbour()}, kTold);
  report::Facts facts;
  facts.hears = {{.node = 3, .loss_255 = 51}};
  facts.channels = {{.number = 6, .publishers = 1, .subscribers = 2, .received_per_10s = 123},
                    {.number = 8, .publishers = 0, .subscribers = 4, .received_per_10s = 7}};
  facts.lost = report::Losses{.air = 21, .kernel = 22, .daemon = 23, .late = 24};
  facts.programs = {"one", "two"};
  facts.name = "left";
  facts.values = {{"led", "#00ff80"}, {"battery", "87"}};
  swarm.note_report(2, facts, kTold + milliseconds(100));
}

const char* const kOwn =
    R"({"id": 1, "x": 0.5, "y": 0.625, "th": -1.5, "pose_age": 330, "heard_age": 300,
        "self": true})";
const char* const kOther =
    R"({"id": 2, "x": 3.5, "y": -4.25, "th": 0.75, "pose_age": 340, "heard_age": 320,
        "told_age": 200, "twin": true, "ghost": true, "name": "left", "led": "#00ff80"})";

Message message() {
  Message made;
  made.channel = 6;
  made.sender = 2;
  made.payload = std::string("\x00\x7f\xff", 3);
  made.hops = 3;
  made.distance_m = 1.5f;
  made.bearing_rad = 0.25f;
  return made;
}

void fill(Traffic& traffic) {
  DaemonStatus status;
  ChannelStatus channel;
  channel.number = 6;
  channel.name = "news";
  channel.publishers = 1;
  channel.subscribers = 2;
  channel.lost = Loss{31, 32, 33, 34, 35};
  status.channels = {channel};
  traffic.note_status(status);
  for (int i = 0; i < 5; ++i) traffic.note_message(message(), kTold - seconds(1));
  Message other = message();
  other.sender = 9;
  traffic.note_message(other, kTold + milliseconds(50));
}

const char* const kNews =
    R"({"n": 6, "name": "news", "rate": 5.0, "messages": 6, "bytes": 18, "publishers": 1,
        "subscribers": 2, "age": 250, "senders": [[2, 1300], [9, 250]],
        "lost": {"air": 31, "kernel": 32, "daemon": 33, "client": 34, "late": 35}})";

TEST(SwarmJson, OfAllThatMoves) {
  ToldSource source;
  fill(source.known());
  Json wanted{{"t", "state"}, {"self", 1}, {"robots", {Json::parse(kOwn), Json::parse(kOther)}}};
  wanted["links"] = {{2, 1, 0.125, 320}, {3, 2, 0.2, 200}};
  EXPECT_EQ(Json::parse(state_json(source)), wanted);
  EXPECT_EQ(Json::parse(swarm_state_json(source.swarm(), kLooked)), wanted);
  source.lost_daemon_at_ = kTold + milliseconds(90);
  wanted["no_daemon_age"] = 210;
  EXPECT_EQ(Json::parse(state_json(source)), wanted);
}

TEST(SwarmJson, OfRobotsThatAreTooMany) {
  ToldSource source;
  for (std::uint32_t id = 1; id <= Swarm::kMostRobots + 3; ++id)
    source.known().note_sign(id, kTold);
  EXPECT_EQ(Json::parse(state_json(source)).at("left_out"), 3);
}

TEST(SwarmJson, OfTheCardOfARobot) {
  Swarm swarm;
  fill(swarm);
  Json wanted = Json::parse(kOther);
  wanted.update(Json::parse(
      R"({"t": "card", "known": true, "epoch": 77, "link": "wifi", "address": "02:00:00:00:00:02",
          "distance": 1.25, "bearing": -0.5, "frames": 900, "frames_lost": 11,
          "values": {"led": "#00ff80", "battery": "87"}, "programs": ["one", "two"],
          "lost": {"air": 21, "kernel": 22, "daemon": 23, "client": 0, "late": 24},
          "channels": [[6, 1, 2, 12.3], [8, 0, 4, 0.7]]})"));
  EXPECT_EQ(Json::parse(card_json(swarm, 2, kLooked)), wanted);
  EXPECT_EQ(Json::parse(card_json(swarm, 5, kLooked)),
            Json::parse(R"({"t": "card", "id": 5, "known": false})"));
}

TEST(SwarmJson, OfChannelsLinksAndPrograms) {
  ToldSource source;
  fill(source.known());
  fill(source.heard());
  report::Facts facts;
  facts.channels = {{.number = 7, .publishers = 1}};
  source.known().note_report(2, facts, kTold + milliseconds(200));
  source.known().note_report(3, facts, kTold);
  LinkStatus link;
  link.name = "air";
  link.type = "raw_l2";
  link.device = "wlan0";
  link.profile = "robot";
  link.up = true;
  link.state = "as it should be";
  source.status_.links = {link};
  source.status_.uptime = milliseconds(1234);
  source.left_out_ = {{"9", "no room"}};
  Json wanted = Json::parse(
      R"({"t": "info", "daemon": "swarmtalkd 1", "uptime_ms": 1234, "questions": "",
          "left_out": {"9": "no room"},
          "links": [{"name": "air", "type": "raw_l2", "device": "wlan0", "profile": "robot",
                     "up": true, "state": "as it should be"}]})");
  wanted["channels"] = {Json::parse(kNews), {{"n", 7}, {"name", ""}, {"publishing", 2}}};
  EXPECT_EQ(Json::parse(info_json(source)), wanted);
  source.questions_ = Status(StatusCode::kBusy, "nobody answers");
  EXPECT_EQ(Json::parse(info_json(source)).at("questions"), "nobody answers");
}

TEST(SwarmJson, OfMessages) {
  HeardMessage heard;
  heard.number = 41;
  heard.channel = 6;
  heard.sender = 2;
  heard.transmitter = 9;
  heard.hops = 3;
  heard.is_local = true;
  heard.distance_m = 1.5f;
  heard.bearing_rad = 0.25f;
  heard.lost_before = Loss{1, 10, 100, 1000, 5};
  heard.payload = std::string("\x00\x7f\xff", 3);
  heard.unknown_bytes = 12;
  const Json wanted = Json::parse(
      R"({"t": "msg", "k": 41, "n": 6, "from": 2, "hex": "007fff", "size": 12, "hops": 3,
          "via": 9, "local": true, "d": 1.5, "b": 0.25, "lost": 1111})");
  EXPECT_EQ(Json::parse(message_json(heard)), wanted);
  HeardMessage bare;
  bare.hops = Message::kHopsUnknown;
  const Json nothing = Json::parse(R"({"t": "msg", "k": 0, "n": 0, "from": 0, "hex": ""})");
  EXPECT_EQ(Json::parse(message_json(bare)), nothing);
  EXPECT_EQ(Json::parse(messages_json({bare, heard})),
            Json({{"t", "msgs"}, {"list", {nothing, wanted}}}));
}

TEST(SwarmJson, OfLinesAndNotices) {
  EXPECT_EQ(Json::parse(line_json({5, 2, "ready \xff", kTold + milliseconds(60)}, kLooked)),
            Json::parse(R"({"t": "log", "k": 5, "from": 2, "text": "ready \ufffd", "age": 240})"));
  EXPECT_EQ(Json::parse(notice_json("n")), Json::parse(R"({"t": "notice", "text": "n"})"));
  EXPECT_EQ(Json::parse(dropped_json(3, 4)),
            Json::parse(R"({"t": "dropped", "events": 3, "states": 4})"));
  ToldSource source;
  EXPECT_EQ(Json::parse(hello_json(source, true)),
            Json::parse(R"({"t": "hello", "version": 1, "operate": true})"));
  EXPECT_EQ(Json::parse(jump_json(source)), Json::parse(R"({"t": "jump", "at": 0, "trail": []})"));
}

}  // namespace
}  // namespace swarmtalk::view
