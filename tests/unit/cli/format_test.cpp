#include "cli/format.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::cli {
namespace {

Message heard() {
  Message message;
  message.payload = "hello 3";
  message.sender = 1;
  message.distance_m = 0.5F;
  message.bearing_rad = -1.5708F;
  return message;
}

TEST(Format, LineForPeopleHasMetresAndDegrees) {
  EXPECT_EQ(to_line("hello", heard()),
            "hello: robot 1  \"hello 3\"  distance 0.50 m  bearing -90 deg  hops 0");
}

TEST(Format, UnknownIsSaidNotPrintedAsANumber) {
  Message message;
  message.payload = std::string("\0\xff", 2);
  EXPECT_EQ(to_line("7", message),
            "7: robot 0  hex 00ff  distance unknown  bearing unknown  hops 0");
  const Json json = to_json("7", message);
  for (const char* key : {"distance_m", "bearing_rad", "sender_pose", "buffering_delay_us",
                          "received_at_ns", "text"}) {
    ASSERT_TRUE(json.contains(key)) << key;
    EXPECT_TRUE(json[key].is_null()) << key;
  }
  EXPECT_EQ(json["hex"], "00ff");
  EXPECT_EQ(json["size_bytes"], 2);
}

TEST(Format, JsonHasSiUnitsWithoutFloatNoise) {
  Message message = heard();
  message.distance_m = 0.45F;
  message.sender_pose = Pose{1, 2, 3, std::chrono::milliseconds(40)};
  message.buffering_delay = std::chrono::microseconds(1500);
  EXPECT_EQ(
      to_json("hello", message).dump(),
      R"({"channel":"hello","channel_number":0,"sender":1,"epoch":0,"message_number":0,)"
      R"("distance_m":0.45,"bearing_rad":-1.5708,)"
      R"("sender_pose":{"x_m":1.0,"y_m":2.0,"theta_rad":3.0,"age_ms":40},)"
      R"("hops":0,"ttl":0,"buffering_delay_us":1500,"received_at_ns":null,"local":false,)"
      R"("lost_before":{"air":0,"kernel":0,"daemon":0,"client":0,"late":0},"origin":null,"size_bytes":7,"text":"hello 3","hex":"68656c6c6f2033"})");
}

TEST(Format, StatusShowsLinksChannelsAndCountersThatCount) {
  DaemonStatus status;
  status.version = "0.1.0";
  status.node_id = 3;
  status.uptime = std::chrono::seconds(93784);
  LinkStatus link;
  link.name = "wlan0";
  link.state = "up, MTU 1500 bytes";
  link.mtu_bytes = 1400;
  link.counters = {{"frames_received", 12}, {"frames_truncated", 0}};
  status.links.push_back(link);
  ChannelStatus channel;
  channel.number = 40961;
  channel.name = "hello";
  channel.subscribers = 2;
  status.channels.push_back(channel);
  const std::string text = to_text(status);
  EXPECT_NE(text.find("robot 3 (automatic), up 1 d 02:03:04"), std::string::npos) << text;
  EXPECT_NE(text.find("PACKETS UP TO"), std::string::npos) << text;
  EXPECT_NE(text.find("1400 bytes"), std::string::npos) << text;
  EXPECT_NE(text.find("hello    40961"), std::string::npos) << text;
  EXPECT_NE(text.find("frames_received 12"), std::string::npos) << text;
  EXPECT_EQ(text.find("frames_truncated"), std::string::npos) << text;
  EXPECT_EQ(to_json(status)["links"][0]["counters"]["frames_truncated"], 0);
}

TEST(Format, TextWithALineEndIsShownAsText) {
  EXPECT_EQ(payload_text("a\n"), "\"a\\n\"");
  EXPECT_EQ(payload_text("\xff"), "hex ff");
}

TEST(Format, DegreesHaveNoMinusZero) {
  EXPECT_EQ(degrees(-0.001F), "0 deg");
}

}  // namespace
}  // namespace swarmtalk::cli
