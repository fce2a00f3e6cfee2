// What a robot's own record holds, and whose turn it is where there is more than fits.
#include "daemon/answer/own_record.hpp"

#include <gtest/gtest.h>

#include <set>

#include "report/report.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using namespace std::chrono_literals;

class OwnRecordTest : public testing::Test {
 protected:
  OwnRecordTest() {
    hub_.add(first_);
    hub_.add(second_);
  }

  report::Facts facts(bool with_details = false) {
    const auto decoded = report::decode_body(record_.body(with_details, now_));
    EXPECT_TRUE(decoded);
    return decoded.value_or(report::Facts());
  }
  Subscription& subscribe(std::uint32_t channel) {
    auto& made = *subscriptions_.emplace_back(std::make_unique<Subscription>());
    made.client = &client_;
    EXPECT_FALSE(hub_.subscribe({"", channel, std::nullopt}, made));
    return made;
  }
  void receive(std::uint16_t channel, std::uint32_t number) {
    MessageHead head;
    head.channel = channel;
    head.sender = 9;
    head.number = number;
    first_.receive(head, "x");
  }
  static std::vector<Neighbour> robots(std::uint16_t from, std::size_t count) {
    std::vector<Neighbour> all(count);
    for (Neighbour& each : all) each.node = from++;
    return all;
  }

  ChannelTable names_{{}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  PoseKeeper poses_{NodeConfig{}};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation first_{hub_, "first"};
  FakeStation second_{hub_, "second"};
  FakeClient client_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  std::vector<std::string> programs_;
  OwnRecord record_{hub_, poses_, [this] { return programs_; }};
  OwnRecord::Time now_ = std::chrono::steady_clock::now();
};

TEST_F(OwnRecordTest, SaysWhereTheRobotIsWhereThatIsKnown) {
  EXPECT_FALSE(facts().place);
  poses_.set(1, -2, 0, std::nullopt);
  ASSERT_TRUE(facts().place);
  EXPECT_EQ(facts().place->x_mm, 1000);
  EXPECT_EQ(facts().place->y_mm, -2000);
  poses_.set(1, -2, 0, now_ - 1h);
  EXPECT_FALSE(facts().place) << "a stale one says nothing";
}

TEST_F(OwnRecordTest, TellsWhomItHearsOnAllLinksWithinItsRange) {
  first_.around = robots(1, 2);
  second_.around = robots(7, 1);
  first_.around[1].is_out_of_range = true;
  const std::vector<report::Hearing> hears = facts().hears;
  ASSERT_EQ(hears.size(), 2u);
  EXPECT_EQ(hears[0].node, 1);
  EXPECT_EQ(hears[1].node, 7);
  EXPECT_EQ(record_.neighbours(now_), 3u);
}

TEST_F(OwnRecordTest, AllNeighboursHaveTheirTurn) {
  for (const bool with_details : {false, true}) {
    const std::size_t most =
        with_details ? OwnRecord::kMostHearingsInDetail : OwnRecord::kMostHearings;
    first_.around = robots(1, most);
    EXPECT_EQ(facts(with_details).hears.size(), most);
    EXPECT_EQ(facts(with_details).hears[0].node, 1) << "all fit: no turns";
    first_.around = robots(1, most + 3);
    std::vector<std::uint16_t> told;
    for (int turn = 0; turn < 2; ++turn) {
      for (const report::Hearing& each : facts(with_details).hears) told.push_back(each.node);
    }
    ASSERT_EQ(told.size(), 2 * most);
    for (std::size_t i = 1; i < told.size(); ++i) {
      EXPECT_EQ(told[i], told[i - 1] % (most + 3) + 1) << "round and round";
    }
  }
}

TEST_F(OwnRecordTest, TellsHowMuchIsHeardOnEachChannel) {
  subscribe(1);
  subscribe(2);
  subscribe(2);
  Publisher publisher;
  publisher.client = &client_;
  ASSERT_FALSE(hub_.advertise({"", 2, std::nullopt}, publisher));
  receive(1, 1);
  std::vector<report::ChannelUse> channels = facts().channels;
  ASSERT_EQ(channels.size(), 2u);
  EXPECT_EQ(channels[0].number, 1);
  EXPECT_EQ(channels[0].subscribers, 1);
  EXPECT_EQ(channels[0].publishers, 0);
  EXPECT_EQ(channels[0].received_per_10s, 0) << "there is no time to count over yet";
  EXPECT_EQ(channels[1].subscribers, 2);
  EXPECT_EQ(channels[1].publishers, 1);
  for (std::uint32_t number = 2; number <= 8; ++number) receive(1, number);
  now_ += 2s;
  channels = facts().channels;
  EXPECT_EQ(channels[0].received_per_10s, 35) << "7 in 2 s";
  EXPECT_EQ(channels[1].received_per_10s, 0);
  receive(1, 20);
  now_ += 20s;
  const report::Facts last = facts();
  EXPECT_EQ(last.channels[0].received_per_10s, 1) << "1 in 20 s, rounded up";
  ASSERT_TRUE(last.lost);
  EXPECT_EQ(last.lost->air, 11u);
  EXPECT_EQ(last.lost->kernel + last.lost->daemon + last.lost->late, 0u);
  hub_.unadvertise(publisher);
}

TEST_F(OwnRecordTest, AllChannelsHaveTheirTurn) {
  constexpr std::size_t kMore = 3;
  for (std::uint32_t i = 1; i <= OwnRecord::kMostChannels + kMore; ++i) subscribe(i);
  std::vector<std::uint16_t> told;
  for (int turn = 0; turn < 2; ++turn) {
    for (const report::ChannelUse& each : facts().channels) told.push_back(each.number);
  }
  ASSERT_EQ(told.size(), 2 * OwnRecord::kMostChannels);
  for (std::size_t i = 1; i < told.size(); ++i) {
    EXPECT_EQ(told[i], told[i - 1] % (OwnRecord::kMostChannels + kMore) + 1);
  }
  EXPECT_EQ(facts(true).channels.size(), OwnRecord::kMostChannelsInDetail);
}

TEST_F(OwnRecordTest, TellsItsNameInOneOfFourRecordsAndInDetails) {
  record_.set_name("thymio");
  std::string told;
  for (int i = 0; i < 9; ++i) told += facts().name ? '1' : '0';
  EXPECT_EQ(told, "100010001");
  EXPECT_EQ(facts(true).name, "thymio");
}

TEST_F(OwnRecordTest, TellsProgramsInDetailOnly) {
  for (int i = 0; i < 8; ++i) programs_.push_back(std::to_string(i) + std::string(40, 'x'));
  EXPECT_FALSE(facts().programs);
  const auto told = facts(true).programs;
  ASSERT_TRUE(told);
  ASSERT_EQ(told->size(), OwnRecord::kMostPrograms);
  EXPECT_EQ((*told)[0], "0" + std::string(19, 'x'));
  EXPECT_EQ((*told)[5], "5" + std::string(19, 'x'));
}

TEST_F(OwnRecordTest, KeepsValuesUntilTheyWereNotToldForTwoQuestions) {
  const auto told = [this] {
    std::map<std::string, std::string> values;
    for (const report::Value& each : facts(true).values) values[each.key] = each.text;
    return values;
  };
  using Values = std::map<std::string, std::string>;
  record_.begin_values();
  record_.note_value("a", "1");
  record_.note_value("b", "2");
  record_.note_value("", "3");
  EXPECT_EQ(told(), (Values{{"a", "1"}, {"b", "2"}}));
  EXPECT_TRUE(facts().values.empty());
  record_.begin_values();
  record_.note_value("a", "9");
  EXPECT_EQ(told(), (Values{{"a", "9"}, {"b", "2"}})) << "b may still answer";
  record_.begin_values();
  EXPECT_EQ(told(), (Values{{"a", "9"}}));
  record_.note_value("c", "4");
  record_.forget_values();
  EXPECT_TRUE(told().empty());
  record_.begin_values();
  EXPECT_TRUE(told().empty());
}

TEST_F(OwnRecordTest, LeavesOutKeysThatAreTooLongAndCutsTexts) {
  record_.begin_values();
  record_.note_value(std::string(report::kMostKeyBytes + 1, 'k'), "x");
  record_.note_value(std::string(report::kMostKeyBytes, 'k'),
                     std::string(report::kMostValueBytes, 'v'));
  record_.note_value("long", std::string(report::kMostValueBytes + 1, 'v'));
  std::map<std::string, std::string> values;
  for (const report::Value& each : facts(true).values) values[each.key] = each.text;
  ASSERT_EQ(values.size(), 2u);
  EXPECT_EQ(values[std::string(report::kMostKeyBytes, 'k')],
            std::string(report::kMostValueBytes, 'v'));
  EXPECT_EQ(values["long"], std::string(report::kMostValueBytes - 3, 'v') + "...");
}

TEST_F(OwnRecordTest, KnowsSixtyFourValuesOfWhichEachHasItsTurn) {
  record_.begin_values();
  for (int i = 100; i < 200; ++i) record_.note_value(std::to_string(i), "x");
  record_.note_value("100", "y");
  std::set<std::string> told;
  bool is_newest = false;
  for (int i = 0; i < 13; ++i) {
    const auto values = facts(true).values;
    EXPECT_EQ(values.size(), OwnRecord::kMostValuesInDetail);
    for (const report::Value& each : values) {
      told.insert(each.key);
      is_newest |= each.key == "100" && each.text == "y";
    }
  }
  EXPECT_EQ(told.size(), OwnRecord::kMostValues);
  EXPECT_TRUE(told.contains("163"));
  EXPECT_FALSE(told.contains("164"));
  EXPECT_TRUE(is_newest) << "a known one may change where there is no room";
}

}  // namespace
}  // namespace swarmtalk::daemon
