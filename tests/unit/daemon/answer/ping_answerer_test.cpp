#include "daemon/answer/ping_answerer.hpp"

#include <gtest/gtest.h>

#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

class PingAnswererTest : public testing::Test {
 protected:
  PingAnswererTest() {
    hub_.add(station_);
    answerer_.set_hook([this] { ++hooks_; });
    EXPECT_FALSE(answerer_.start());
    channel_ = names_.find("ping").number;
  }

  void hear(const std::string& text, std::uint64_t at_ms, std::uint8_t hops = 2,
            std::uint16_t transmitter = 7) {
    MessageHead head;
    head.channel = channel_;
    head.sender = 9;
    head.transmitter = transmitter;
    head.number = ++heard_;
    head.hops = hops;
    head.received_at_ns = 1'000'000'000 + at_ms * 1'000'000;
    station_.receive(head, text);
  }
  /// What leaves, one by one.
  void answer() {
    answerer_.answer();
    while (station_.busy.contains(channel_)) station_.leave(channel_);
  }

  ChannelTable names_{{}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation station_{hub_};
  PingAnswerer answerer_{hub_, identity_, counters_};
  int hooks_ = 0;
  std::uint16_t channel_ = 0;
  std::uint32_t heard_ = 0;
};

TEST_F(PingAnswererTest, AnswersAQuestionForThisRobotAndSaysFromWhomItHasIt) {
  hear("ping 1234 1 5 3", 0);
  EXPECT_EQ(hooks_, 1);
  EXPECT_TRUE(station_.sent.empty()) << "only once the hub has delivered the question";
  answer();
  ASSERT_EQ(station_.sent.size(), 1u);
  EXPECT_EQ(station_.sent[0].payload, "pong 1234 1 1 2 7");
  hear("ping 1234 2 5 3", 1000, 0, 9);
  answer();
  EXPECT_EQ(station_.sent[1].payload, "pong 1234 2 2 0 9");
  EXPECT_EQ(counters_.pings_answered, 2u);
}

TEST_F(PingAnswererTest, LeavesAloneWhatIsNotAQuestionToThisRobot) {
  for (const char* text : {"ping 1 1 6 3", "ping 1 1 5", "ping 1 1 5 3 4", "ping 1 x 5 3", "ping",
                           "pong 1 1 1 0 9", "", "ping 99999999999 1 5 3", "ping  1 1 5 3"}) {
    hear(text, 0);
  }
  EXPECT_EQ(hooks_, 0);
  EXPECT_EQ(counters_.pings_unanswered, 0u);
}

TEST_F(PingAnswererTest, AnswersNoMoreThanItsRateWhoeverAsks) {
  for (std::uint64_t i = 0; i < 1000; ++i) {  // ten seconds of a hundred a second
    hear("ping " + std::to_string(i % 100) + " 1 5 3", i * 10);
    answer();
  }
  EXPECT_GE(counters_.pings_answered, 50u);
  EXPECT_LE(counters_.pings_answered, PingAnswerer::kRateHz * 10 + PingAnswerer::kBurst);
  EXPECT_EQ(counters_.pings_answered + counters_.pings_unanswered, 1000u);
  EXPECT_EQ(station_.sent.size(), counters_.pings_answered);
}

}  // namespace
}  // namespace swarmtalk::daemon
