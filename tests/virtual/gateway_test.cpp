// Robots on two airs: gateways between a large profile and a small one, two of them side by side,
// and a robot that hears another over both.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/virtual/swarm.hpp"

namespace swarmtalk::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

const std::string kWifi = "[links.wifi]\ntype = \"udp\"\n";

/// @param keys  more of this link
std::string small(const std::string& profile, const std::string& keys = "") {
  return "[links.small]\ntype = \"udp\"\nprofile = \"" + profile + "\"\n" + keys +
         "[channels]\nhot = 3\n";
}

/// Paced, so that what goes round in a circle takes time, and a test ends.
/// @param node_id  on the small air
std::string gateway(const std::string& profile, int node_id) {
  const std::string paced = "rate_hz = 50\n";
  return kWifi + paced + small(profile, paced + "node_id = " + std::to_string(node_id) + "\n") +
         "[[gateway]]\nfrom = \"wifi/alarm\"\nto = \"small/hot\"\nboth_ways = true\n";
}

/// What comes from other robots, as "TEXT of SENDER", and where it was sent first if it has crossed
/// a gateway: "TEXT of SENDER from LINK/NODE", or "from somewhere".
class Ear {
 public:
  Ear(VirtualRobot& robot, const std::string& channel)
      : subscriber_(robot.program("ear").client().subscribe(
            channel, Policy::last(64), [this](const Message& message) { hear(message); })) {}

  std::vector<std::string> heard() const {
    std::vector<std::string> sorted = heard_;
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  }

 private:
  void hear(const Message& message) {
    if (message.local) return;
    std::string text(message.text());
    text += " of " + std::to_string(message.sender);
    if (message.origin) {
      const GatewayOrigin& origin = *message.origin;
      const bool is_known = !origin.link.empty() || origin.node != 0 || origin.message_number != 0;
      text += " from " + (is_known ? origin.link + "/" + std::to_string(origin.node) : "somewhere");
    }
    heard_.push_back(text);
  }

  std::vector<std::string> heard_;
  Subscriber subscriber_;
};

TEST(VirtualGateway, CarriesMessagesToASmallProfileAndBackWithTheirOrigin) {
  Swarm swarm;
  swarm.add(1, {}, kWifi);
  swarm.add(9, {}, small("kilobot"));
  swarm.add(2, {}, gateway("kilobot", 250));
  const Ear at_small(swarm.robot(9), "hot");
  const Ear at_wifi(swarm.robot(1), "alarm");
  swarm.robot(1).program("mouth").send("alarm", "12345");
  swarm.advance(1s);
  EXPECT_THAT(at_small.heard(), ElementsAre("12345 of 250 from somewhere"))
      << "packets of this profile do not name an origin";
  swarm.robot(9).program("mouth").send("hot", "hot!!");
  swarm.advance(1s);
  EXPECT_THAT(at_wifi.heard(), ElementsAre("hot!! of 2 from small/9"));
}

TEST(VirtualGateway, CarriesMessagesOfItsOwnProgramsToBothLinks) {
  Swarm swarm;
  swarm.add(1, {}, kWifi);
  swarm.add(9, {}, small("kilobot"));
  swarm.add(2, {}, gateway("kilobot", 250));
  const Ear at_small(swarm.robot(9), "hot");
  const Ear at_wifi(swarm.robot(1), "alarm");
  swarm.robot(2).program("mouth").send("alarm", "stop!");
  swarm.advance(1s);
  EXPECT_THAT(at_wifi.heard(), ElementsAre("stop! of 2"));
  EXPECT_THAT(at_small.heard(), ElementsAre("stop! of 250 from somewhere"));
}

/// Three messages each way, over two gateways side by side. Texts are of five bytes: what fills a
/// packet of the small profiles, which do not say how long a message is.
class VirtualGateways : public testing::TestWithParam<const char*> {
 protected:
  void add_robots() {
    swarm_.add(1, {0, 0}, kWifi);
    swarm_.add(250, {1, 0}, gateway(GetParam(), 250));
    swarm_.add(251, {2, 0}, gateway(GetParam(), 251));
    swarm_.add(9, {3, 0}, small(GetParam()));
  }
  void exchange_messages() {
    const Ear at_wifi(swarm_.robot(1), "alarm");
    const Ear at_small(swarm_.robot(9), "hot");
    for (const char* number : {"1", "2", "3"}) {
      swarm_.robot(1).program("mouth").send("alarm", std::string("wifi") + number, 2);
      swarm_.robot(9).program("mouth").send("hot", std::string("tiny") + number, 2);
      swarm_.advance(1s);
    }
    const std::uint64_t frames = frames_sent();
    swarm_.advance(60s);
    EXPECT_EQ(frames_sent(), frames) << "something goes on by itself";
    heard_at_wifi_ = at_wifi.heard();
    heard_at_small_ = at_small.heard();
  }
  std::uint64_t frames_sent() {
    return swarm_.air("wifi").frames_sent() + swarm_.air("small").frames_sent();
  }
  void expect_copies(int robot, std::uint64_t sent, std::uint64_t there) {
    const daemon::DaemonCounters& counters = swarm_.robot(robot).parts().counters();
    EXPECT_EQ(counters.gateway_sent, sent) << robot;
    EXPECT_EQ(counters.gateway_there, there) << robot;
    EXPECT_EQ(counters.gateway_full, 0u) << robot;
    EXPECT_EQ(counters.gateway_link_down, 0u) << robot;
  }

  Swarm swarm_;
  std::vector<std::string> heard_at_wifi_;
  std::vector<std::string> heard_at_small_;
};

using VirtualGatewaysWithOrigins = VirtualGateways;
INSTANTIATE_TEST_SUITE_P(To, VirtualGatewaysWithOrigins, testing::Values("wifi"));

TEST_P(VirtualGatewaysWithOrigins, CopyEachMessageAndItIsHeardOnce) {
  add_robots();
  exchange_messages();
  EXPECT_THAT(heard_at_wifi_, ElementsAre("tiny1 of 250 from small/9", "tiny2 of 250 from small/9",
                                          "tiny3 of 250 from small/9"));
  EXPECT_THAT(heard_at_small_, ElementsAre("wifi1 of 250 from wifi/1", "wifi2 of 250 from wifi/1",
                                           "wifi3 of 250 from wifi/1"));
  for (const int n : {250, 251}) expect_copies(n, 6, 0);
}

/// The second gateway hears the first one's copy before the message itself, which takes a hop.
TEST_P(VirtualGatewaysWithOrigins, DoNotCopyWhatIsThereAlready) {
  swarm_.air("wifi").set_range(1.5);
  add_robots();
  exchange_messages();
  expect_copies(250, 6, 0);
  expect_copies(251, 3, 3);
}

/// Packets of these profiles cannot name an origin: there each gateway's copy is a message of its
/// own. Back on the large profile it has one again.
using VirtualGatewaysWithoutOrigins = VirtualGateways;
INSTANTIATE_TEST_SUITE_P(To, VirtualGatewaysWithoutOrigins, testing::Values("kilobot", "footbot"));

TEST_P(VirtualGatewaysWithoutOrigins, CopyEachMessageAndNoneOfTheOthersCopies) {
  add_robots();
  exchange_messages();
  EXPECT_THAT(heard_at_wifi_, ElementsAre("tiny1 of 250 from small/9", "tiny2 of 250 from small/9",
                                          "tiny3 of 250 from small/9"));
  EXPECT_THAT(heard_at_small_,
              ElementsAre("wifi1 of 250 from somewhere", "wifi1 of 251 from somewhere",
                          "wifi2 of 250 from somewhere", "wifi2 of 251 from somewhere",
                          "wifi3 of 250 from somewhere", "wifi3 of 251 from somewhere"));
  for (const int n : {250, 251}) {
    expect_copies(n, 6, 0);
    EXPECT_EQ(swarm_.robot(n).parts().counters().gateway_crossed, 3u) << n;
  }
}

/// What one air loses the other brings, and nothing is heard twice.
TEST(VirtualTwoLinks, BringEachMessageOnceAlsoWhereOneLosesIt) {
  Swarm swarm;
  for (const int n : {1, 2}) swarm.add(n, {}, kWifi + small("wifi"));
  VirtualProgram& mouth = swarm.robot(1).program("mouth");
  VirtualProgram& ear = swarm.robot(2).program("ear");
  ear.subscribe("c");
  for (const char* text : {"0", "1", "2", "3"}) {
    swarm.air("wifi").set_loss(text[0] == '1' ? 1 : 0);
    swarm.air("small").set_loss(text[0] == '2' ? 1 : 0);
    mouth.send("c", text);
    swarm.advance(100ms);
  }
  EXPECT_THAT(ear.heard(), ElementsAre("0", "1", "2", "3"));
  const daemon::DaemonCounters& counters = swarm.robot(2).parts().counters();
  EXPECT_EQ(counters.link_duplicates, 2u);
  EXPECT_EQ(counters.messages_lost_air, 0u) << "what one link lost, the other brought";
}

/// A channel of both links carries what the smaller one does.
TEST(VirtualTwoLinks, RefuseWhatTheSmallOneCannotCarry) {
  Swarm swarm;
  Client& client = swarm.add(2, {}, kWifi + small("kilobot")).program("mouth").client();
  client.on_error({});
  const auto answer_to = [&](const std::string& channel, const std::string& text,
                             std::optional<std::uint32_t> ttl = {}) {
    std::string answer = "none";
    Publisher publisher = client.advertise(
        channel, {}, [&](const Status& status) { answer = status ? "sent" : status.text(); });
    if (const Status status = publisher.send(text, ttl); !status) return std::string(status.text());
    swarm.advance(1s);
    return answer;
  };
  EXPECT_EQ(answer_to("hot", std::string(40, 'x')), "sent");
  EXPECT_THAT(answer_to("hot", std::string(41, 'x')),
              HasSubstr("41 bytes; channel hot carries at most 40"));
  EXPECT_THAT(answer_to("hot", ""), HasSubstr("at least 1 byte"));
  EXPECT_EQ(answer_to("hot", "x", 15), "sent");
  EXPECT_THAT(answer_to("hot", "x", 16), HasSubstr("TTL of 16; channel hot carries at most 15"));
  EXPECT_EQ(answer_to("big", std::string(5000, 'x')), "sent");
  EXPECT_EQ(answer_to("big", "x", 16), "sent");
}

}  // namespace
}  // namespace swarmtalk::test
