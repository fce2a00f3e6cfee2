#include "cli/text/format.hpp"

#include <gtest/gtest.h>

#include <sstream>

#include "cli/common/quiet_watch.hpp"
#include "cli/text/numbers.hpp"

namespace swarmtalk::cli {
namespace {

Message heard() {
  Message message;
  message.payload = "hello 3";
  message.sender = 1;
  message.transmitter = 1;
  message.distance_m = 0.5F;
  message.bearing_rad = -1.5708F;
  return message;
}

TEST(Format, TheMedianOfAnEvenNumberIsBetweenTheTwoInTheMiddle) {
  EXPECT_EQ(median({}), std::nullopt);
  EXPECT_EQ(median({7}), 7.0);
  EXPECT_EQ(median({34, 15}), 24.5);
  EXPECT_EQ(median({9, 1, 5}), 5.0);
}

TEST(Format, LineForPeopleHasMetresAndDegrees) {
  EXPECT_EQ(to_line("hello", heard()),
            "hello: robot 1  \"hello 3\"  distance 0.50 m  bearing -90 deg  hops 0");
}

TEST(Format, ARelayedMessageSaysWhoseDistanceItIs) {
  Message message = heard();
  message.hops = 2;
  message.transmitter = 3;
  EXPECT_EQ(to_line("hello", message),
            "hello: robot 1  \"hello 3\"  via robot 3  distance 0.50 m  bearing -90 deg  hops 2");
  message.transmitter = message.sender;  // the packets do not tell
  EXPECT_EQ(to_line("hello", message),
            "hello: robot 1  \"hello 3\"  via another robot  distance 0.50 m  bearing -90 deg  "
            "hops 2");
}

TEST(Format, APoseThatIsTooOldSaysHowOldAndWhoToldIt) {
  DaemonStatus status;
  EXPECT_EQ(pose_text(status), "unknown: nobody has told one");
  status.pose_age = std::chrono::milliseconds(3400);
  status.pose_told_by = "tracker";
  status.pose_max_age = std::chrono::milliseconds(2000);
  EXPECT_EQ(pose_text(status),
            "too old: set by tracker 3.4 s ago; poses expire after 2.0 s "
            "(node.pose_max_age_ms of the configuration)");
  status.pose = Pose{1, 2, 0, std::chrono::milliseconds(40)};
  EXPECT_EQ(pose_text(status), "x 1.000 m  y 2.000 m  theta 0 deg  age 40 ms, told by tracker");
}

TEST(Format, ATableCountsCharactersNotBytes) {
  EXPECT_EQ(table({{"CHANNEL", "LOST"}, {"h\u00f6he", "0"}, {"speed", "0"}}),
            "CHANNEL  LOST\nh\u00f6he     0\nspeed    0\n");
  EXPECT_EQ(table({{"C", "N"}, {"\u00e4\u00f6\u00fc", "1"}, {"abc", "2"}}),
            "C    N\n\u00e4\u00f6\u00fc  1\nabc  2\n");
}

TEST(Format, ATableWiderThanTheTerminalIsABlockForEachRow) {
  const std::vector<Row> rows{{"ROBOT", "DISTANCE", ""}, {"7", "0.50 m", ""}, {"12", "", "lost"}};
  EXPECT_EQ(table(rows), "ROBOT  DISTANCE\n7      0.50 m\n12               lost\n");
  EXPECT_EQ(table(rows, {20, false}), "ROBOT  7\nDISTANCE  0.50 m\n\nROBOT  12\nlost\n");
  EXPECT_EQ(table(rows, {40, true}),
            "\033[1mROBOT  DISTANCE\033[0m\n7      0.50 m\n12               lost\n");
}

TEST(Format, ColoursOfOursStayOnATerminalAndNothingElseDoes) {
  const Look look{80, true};
  const std::string text = look.bold("LINK") + "\033[2J" + look.warning("h\u00f6he") + "\n\033[1";
  EXPECT_EQ(plain_lines(text, look),
            "\033[1mLINK\033[0m\\u001b[2J\033[33mh\u00f6he\033[0m\n\\u001b[1");
  EXPECT_EQ(plain_lines("\033[1mx", Look{}), "\\u001b[1mx");
}

Neighbour neighbour(std::uint32_t node_id, const std::string& link) {
  Neighbour robot;
  robot.node_id = node_id;
  robot.link = link;
  robot.address = "02:00:00:00:00:07";
  robot.distance_m = 1.5f;
  robot.bearing_rad = -3.0f;
  robot.age = std::chrono::milliseconds(9999);
  robot.loss = 1;
  return robot;
}

TEST(Format, ANeighbourIsALineAndWhatSaysNothingIsLeftOut) {
  std::vector<Neighbour> robots{neighbour(7, "wifi"), neighbour(65535, "wifi")};
  EXPECT_EQ(to_text(robots),
            "ROBOT  DISTANCE  BEARING   HEARD AGO  LOSS\n"
            "7      1.50 m    -172 deg  9999 ms    100 %\n"
            "65535  1.50 m    -172 deg  9999 ms    100 %\n");
  robots[1].signal_dbm = -88;
  robots[1].link = "mesh";
  EXPECT_EQ(to_text(robots),
            "ROBOT  LINK  DISTANCE  BEARING   HEARD AGO  LOSS   SIGNAL\n"
            "7      wifi  1.50 m    -172 deg  9999 ms    100 %  -\n"
            "65535  mesh  1.50 m    -172 deg  9999 ms    100 %  -88 dBm\n");
}

TEST(Format, NeighboursFitATerminalAndAddressesAreForWhoeverAsks) {
  std::vector<Neighbour> robots{neighbour(65535, "wifi"), neighbour(7, "wifi")};
  for (Neighbour& each : robots) {
    each.signal_dbm = -88;
    each.duplicate_id = true;
  }
  const std::string lines = to_text(robots, Look{80, false});
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 3) << lines;
  EXPECT_EQ(lines.find("02:00"), std::string::npos);
  const std::string whole = to_text(robots, Look{}, true);
  EXPECT_NE(whole.find("02:00:00:00:00:07  unknown  TWO ROBOTS HAVE THIS ID"), std::string::npos)
      << whole;
}

TEST(QuietWatch, SaysWhatAMisspeltNameMayHaveBeen) {
  DaemonStatus daemon;
  daemon.links.emplace_back().up = true;
  ChannelStatus& channel = daemon.channels.emplace_back();
  channel.name = "chatter";
  channel.publishers = 1;
  daemon.channels.emplace_back().name = "chater";  // our own subscription
  Neighbour robot;
  const std::string text = silence_text({"chater"}, daemon, {robot});
  EXPECT_EQ(text, "nobody publishes 'chater' as far as this robot knows; did you mean 'chatter'?");
  EXPECT_NE(silence_text({"chater"}, daemon, {}).find("did you mean 'chatter'? No other robot was"),
            std::string::npos);
  EXPECT_EQ(silence_text({"chatter"}, daemon, {robot}), "");
  EXPECT_EQ(silence_text({"alarm"}, daemon, {robot}),
            "robots are around, and none of them has sent on 'alarm' so far; swarmtalk-cli "
            "channels shows what is on the air");
}

TEST(QuietWatch, SaysWhatAMisspeltPublishedNameMayHaveBeen) {
  DaemonStatus daemon;
  ChannelStatus& channel = daemon.channels.emplace_back();
  channel.name = "chatter";
  channel.subscribers = 1;
  ChannelStatus& own = daemon.channels.emplace_back();
  own.name = "chater";
  own.publishers = 1;  // ourselves
  EXPECT_EQ(misspelt_text("chater", daemon),
            "no other program of this robot uses channel 'chater'; did you mean 'chatter'?");
  EXPECT_EQ(misspelt_text("chatter", daemon), "");
  EXPECT_EQ(misspelt_text("alarm", daemon), "");
  EXPECT_EQ(misspelt_text("7", daemon), "");
  own.subscribers = 1;
  EXPECT_EQ(misspelt_text("chater", daemon), "") << "somebody hears it";
}

TEST(QuietWatch, SaysThatPerhapsNobodyGetsWhatIsPublished) {
  DaemonStatus daemon;
  daemon.uptime = std::chrono::seconds(3);
  EXPECT_EQ(unheard_text("a", daemon, {}), "") << "a link that is down is told elsewhere";
  LinkStatus& link = daemon.links.emplace_back();
  link.up = true;
  EXPECT_NE(unheard_text("a", daemon, {}).find("no robot was heard"), std::string::npos);
  EXPECT_EQ(unheard_text("a", daemon, {Neighbour{}}), "");
  ChannelStatus& channel = daemon.channels.emplace_back();
  channel.number = 7;
  channel.subscribers = 1;
  EXPECT_EQ(unheard_text("7", daemon, {}), "") << "a program of this robot hears it";
  EXPECT_NE(unheard_text("a", daemon, {}), "");
  link.type = "kilobot";
  EXPECT_EQ(unheard_text("a", daemon, {}), "")
      << "a controller speaks to robots that it never hears";
  link.type = "udp";
  daemon.uptime = std::chrono::milliseconds(2999);
  EXPECT_EQ(unheard_text("a", daemon, {}), "") << "beacons of others need a second";
}

TEST(QuietWatch, SaysThatNobodyIsAround) {
  DaemonStatus daemon;
  EXPECT_EQ(silence_text({"a"}, daemon, {}), "") << "a link that is down is told elsewhere";
  daemon.links.emplace_back().up = true;
  EXPECT_NE(silence_text({"a"}, daemon, {}).find("no other robot was heard"), std::string::npos);
  Neighbour far;
  far.out_of_range = true;
  EXPECT_NE(silence_text({"a"}, daemon, {far}).find("virtual_range_m"), std::string::npos);
}

TEST(QuietWatch, AWildcardIsToldToBeAName) {
  EXPECT_EQ(wildcard_hint({"hello", "7"}), "");
  EXPECT_NE(wildcard_hint({"#"}).find("swarmtalk-cli sub --all"), std::string::npos);
  EXPECT_NE(wildcard_hint({"hello", "#"}).find("'#' is heard as the name of one channel"),
            std::string::npos);
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
      R"({"channel":"hello","channel_number":0,"sender":1,"transmitter":1,"epoch":0,)"
      R"("message_number":0,)"
      R"("distance_m":0.45,"bearing_rad":-1.5708,)"
      R"("sender_pose":{"x_m":1.0,"y_m":2.0,"theta_rad":3.0,"age_ms":40},)"
      R"("hops":0,"ttl":0,"buffering_delay_us":1500,"received_at_ns":null,"received_at_unix_s":null,"local":false,)"
      R"("lost_before":{"air":0,"kernel":0,"daemon":0,"client":0,"late":0},"origin":null,"size_bytes":7,"text":"hello 3","hex":"68656c6c6f2033"})");
}

TEST(Format, JsonSaysThatAMessageCrossedAGatewayAlsoWhereItsOriginIsNotKnown) {
  Message message = heard();
  message.origin = GatewayOrigin{};
  EXPECT_EQ(to_json("c", message)["origin"].dump(),
            R"({"link":null,"node":null,"message_number":null})");
  message.origin = GatewayOrigin{"small", 9, 6};
  EXPECT_EQ(to_json("c", message)["origin"].dump(),
            R"({"link":"small","node":9,"message_number":6})");
}

TEST(Format, JsonHasTheWallClockToo) {
  Message message = heard();
  message.received_at = std::chrono::steady_clock::now() - std::chrono::seconds(100);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const double told = to_json("hello", message)["received_at_unix_s"].get<double>();
  EXPECT_NEAR(told, std::chrono::duration<double>(now).count() - 100, 60);
}

TEST(Format, StatusShowsLinksChannelsAndCountersThatCount) {
  DaemonStatus status;
  status.version = "0.1.0";
  status.node_id = 3;
  status.node_id_source = "chosen at random";
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
  EXPECT_NE(text.find("robot 3 (chosen at random), up 1 d 02:03:04"), std::string::npos) << text;
  EXPECT_NE(text.find("PACKETS UP TO"), std::string::npos) << text;
  EXPECT_NE(text.find("1400 bytes"), std::string::npos) << text;
  EXPECT_NE(text.find("hello    40961"), std::string::npos) << text;
  EXPECT_EQ(text.find("frames_received"), std::string::npos) << text;
  EXPECT_NE(text.find("swarmtalk-cli stats"), std::string::npos) << text;
  const std::string stats = to_stats(status);
  EXPECT_NE(stats.find("frames_received 12"), std::string::npos) << stats;
  EXPECT_EQ(stats.find("frames_truncated"), std::string::npos) << stats;
  EXPECT_EQ(to_json(status)["links"][0]["counters"]["frames_truncated"], 0);
}

TEST(Format, StatusAndStatsFitANarrowTerminal) {
  DaemonStatus status;
  status.version = "0.1.0";
  status.config_file = "/etc/swarmtalk/swarmtalkd.toml, and what it says";
  status.pose_age = std::chrono::milliseconds(90000);
  status.pose_told_by = "tracker";
  LinkStatus link;
  link.name = "wlan0";
  link.state = "interface wlan0 is gone, waiting for it to come back as it was";
  link.counters = {{"frames_of_a_name_that_is_rather_long", 12345678}};
  status.links.push_back(link);
  status.channels.emplace_back().name = "hello";
  status.clients_served.emplace_back().name = "controller";
  status.counters = {{"messages_that_have_a_long_name_as_well", 1}};
  Look look;
  look.columns = 40;
  look.has_colour = true;
  for (const std::string& text : {to_text(status, look), to_stats(status, look),
                                  to_text(DaemonStatus{}, look), to_stats({}, look)}) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      const bool is_bold = line.find("\033[1m") != std::string::npos;
      EXPECT_LE(line.size(), is_bold ? 40u + 8 : 40u) << line;
    }
  }
}

TEST(Format, StatsCountWhatWasRefused) {
  DaemonStatus status;
  status.channels.emplace_back().name = "hello";
  status.channels.back().subscribers = 3;
  status.channels.back().onlookers = 2;
  status.channels.back().refused = 71;
  status.clients_served.emplace_back().name = "controller";
  status.clients_served.back().refused = 72;
  const std::string stats = to_stats(status);
  EXPECT_NE(stats.find("REFUSED"), std::string::npos) << stats;
  EXPECT_NE(stats.find(" 71\n"), std::string::npos) << stats;
  EXPECT_NE(stats.find(" 72 "), std::string::npos) << stats;
  const auto json = to_json(status);
  EXPECT_EQ(json["channels"][0]["onlookers"], 2);
  EXPECT_EQ(json["channels"][0]["refused"], 71);
  EXPECT_EQ(json["clients_served"][0]["refused"], 72);
}

TEST(Format, TextWithALineEndIsShownAsText) {
  EXPECT_EQ(payload_text("a\n"), "\"a\\n\"");
  EXPECT_EQ(payload_text("\xff"), "hex ff");
}

TEST(Format, NoNameOfAStrangerFakesTheRestOfItsLine) {
  Message message = heard();
  message.origin = GatewayOrigin{"lab  delay 3 us", 7, 1};
  EXPECT_NE(to_line("c", message).find(R"(robot 7 on link "lab  delay 3 us")"), std::string::npos);
  message.origin = GatewayOrigin{"\u009b2J\u202E", 7, 1};
  EXPECT_NE(to_line("c", message).find(R"(on link "\u009b2J\u202e")"), std::string::npos);
  message.origin = GatewayOrigin{"kilobots", 7, 1};
  EXPECT_NE(to_line("c", message).find("on link kilobots"), std::string::npos);
  DaemonStatus status;
  status.clients_served.push_back({});
  status.clients_served.back().name = "x  1  2\n";
  EXPECT_NE(to_stats(status).find(R"("x  1  2\n")"), std::string::npos);
}

TEST(Format, DegreesHaveNoMinusZero) {
  EXPECT_EQ(degrees(-0.001F), "0 deg");
}

TEST(JsonText, TakesWhatIsNotUtf8) {
  const Json json{{"network", "lab\xff\xfe"}, {"text", "a\xc3"}};
  EXPECT_EQ(json_text(json),
            "{\"network\":\"lab\xEF\xBF\xBD\xEF\xBF\xBD\",\"text\":\"a\xEF\xBF\xBD\"}");
}

}  // namespace
}  // namespace swarmtalk::cli
