#include "daemon/answer/answerer.hpp"

#include <gtest/gtest.h>

#include "report/harvest_text.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using std::chrono::seconds;
using Time = Answerer::Time;

class AnswererTest : public testing::Test {
 protected:
  AnswererTest() {
    hub_.add(station_);
    hub_.set_reserved({.harvest = true, .rate_hz = 1, .burst = 1}, "robot.toml");
    answerer_.set_hook([this](Time at) { due_ = at; });
    EXPECT_FALSE(answerer_.start());
    channel_ = names_.find("harvest").number;
  }

  /// A program of this robot says something on harvest.
  void say_here(const std::string& bytes) {
    Publisher publisher;
    publisher.client = &program_;
    publisher.queue_limit = 4;
    ASSERT_FALSE(hub_.advertise({"harvest", std::nullopt, std::nullopt, 0}, publisher));
    ASSERT_FALSE(hub_.publish(publisher, 1, bytes, std::nullopt));
    hub_.unadvertise(publisher);
    station_.leave(channel_);
  }
  /// That the program of this robot was asked.
  std::vector<report::HarvestQuestion> questions() const {
    std::vector<report::HarvestQuestion> found;
    for (const auto& [id, payload, is_local] : program_.heard) {
      if (const auto question = report::decode_question(payload)) found.push_back(*question);
    }
    return found;
  }
  void hear(const std::string& bytes, std::uint8_t hops = 0, bool crossed_gateway = false) {
    MessageHead head;
    head.channel = channel_;
    head.sender = 9;
    head.number = ++heard_;
    head.hops = hops;
    head.crossed_gateway = crossed_gateway;
    station_.receive(head, bytes);
  }
  std::optional<report::Report> last_sent() {
    return report::decode_report(station_.sent.back().payload);
  }
  /// Reports that have left since the beginning; the hook is followed as the daemon does.
  std::size_t run(seconds duration) {
    for (const Time end = std::chrono::steady_clock::now() + duration; due_ && *due_ < end;) {
      const Time now = *std::exchange(due_, std::nullopt);
      answerer_.report(now);
      if (station_.busy.contains(channel_)) station_.leave(channel_);
    }
    return counters_.reports_sent;
  }

  ChannelTable names_{{}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation station_{hub_};
  PoseKeeper poses_{NodeConfig{}};
  FakeClient program_;
  Answerer answerer_{hub_, identity_, poses_, counters_,
                     [] { return std::vector<std::string>{"wander"}; }};
  std::optional<Time> due_;
  std::uint16_t channel_ = 0;
  std::uint32_t heard_ = 0;
};

report::Report told_by_root() {
  report::Report report;
  report.roots = {{9, 1, 0, 0, 60}};
  return report;
}

TEST_F(AnswererTest, SaysNothingWhileNobodyLooks) {
  say_here("Q1234");
  hear("A1234");
  EXPECT_FALSE(due_);
  EXPECT_EQ(counters_.reports_unreadable, 0u) << "what others say on harvest is not ours to judge";
}

TEST_F(AnswererTest, ReportsWhileAProgramHereLooks) {
  say_here(report::encode(report::Look{60, {5}}));
  ASSERT_TRUE(due_);
  EXPECT_GE(run(seconds(10)), 5u);
  const auto report = last_sent();
  ASSERT_TRUE(report);
  EXPECT_EQ(report->roots.at(0).node, 5);
  EXPECT_EQ(report->roots.at(0).depth, 0);
  EXPECT_EQ(report->records.at(0).node, 5);
  const auto facts = report::decode_body(report->records.at(0).body);
  ASSERT_TRUE(facts && facts->programs);
  EXPECT_EQ(facts->programs->at(0), "wander");
  EXPECT_FALSE(facts->place) << "there is no pose, so none is told";
}

TEST_F(AnswererTest, TellsItsNameNowAndThenAndWithDetails) {
  answerer_.set_name("scout");
  say_here(report::encode(report::Look{60, {7}}));
  std::size_t named = 0, sent = 0;
  while (sent < 8 && due_) {
    const Time now = *std::exchange(due_, std::nullopt);
    answerer_.report(now);
    if (!station_.busy.contains(channel_)) continue;
    ++sent;
    named += report::decode_body(last_sent()->records.at(0).body)->name == "scout" ? 1 : 0;
    station_.leave(channel_);
  }
  EXPECT_EQ(sent, 8u);
  EXPECT_EQ(named, 2u);
}

TEST_F(AnswererTest, TellsProgramsOnlyWhenTheyAreWanted) {
  say_here(report::encode(report::Look{60, {7}}));
  run(seconds(5));
  EXPECT_FALSE(report::decode_body(last_sent()->records.at(0).body)->programs);
}

TEST_F(AnswererTest, AsksItsProgramsForTheirValuesWhereDetailsAreWanted) {
  hub_.set_reserved({.harvest = true, .rate_hz = 100, .burst = 100}, "robot.toml");
  Subscription subscription;
  subscription.client = &program_;
  ASSERT_FALSE(hub_.subscribe({"harvest", std::nullopt, std::nullopt, 0}, subscription));
  say_here(report::encode(report::Look{255, {5}}));
  const std::size_t said = station_.sent.size();
  run(seconds(2));
  ASSERT_EQ(questions().size(), 1u) << "one question in ten seconds";
  const report::HarvestQuestion question = questions().front();
  EXPECT_EQ(question.ttl, 0);
  for (std::size_t i = said; i < station_.sent.size(); ++i) {
    EXPECT_TRUE(report::is_report(station_.sent[i].payload)) << "questions are not for the air";
  }
  std::string stale = report::begin_answer(question.number + 1);
  report::append_value(stale, "stale", "1");
  say_here(stale);
  std::string answer = report::begin_answer(question.number);
  report::append_value(answer, "battery", "3.91");
  report::append_value(answer, "state", std::string(100, 'x'));
  report::append_value(answer, "a key that is longer than twenty", "1");
  say_here(answer);
  run(seconds(4));
  const auto values = report::decode_body(last_sent()->records.at(0).body)->values;
  EXPECT_EQ(values, (std::vector<report::Value>{{"battery", "3.91"},
                                                {"state", std::string(37, 'x') + "..."}}));
  run(seconds(30));  // nobody answers any more
  EXPECT_GE(questions().size(), 3u);
  EXPECT_TRUE(report::decode_body(last_sent()->records.at(0).body)->values.empty());
  hub_.unsubscribe(subscription);
}

TEST_F(AnswererTest, DoesNotAskItsProgramsForARobotThatNobodyWants) {
  Subscription subscription;
  subscription.client = &program_;
  ASSERT_FALSE(hub_.subscribe({"harvest", std::nullopt, std::nullopt, 0}, subscription));
  say_here(report::encode(report::Look{60, {7}}));
  run(seconds(20));
  EXPECT_TRUE(questions().empty());
  hub_.unsubscribe(subscription);
}

TEST_F(AnswererTest, ALookThatComesOverTheAirIsNotListenedTo) {
  hear(report::encode(report::Look{60, {}}));
  EXPECT_FALSE(due_);
}

TEST_F(AnswererTest, AnswersWhoLooksOnAnotherRobotAndPassesRecordsOn) {
  hear(report::encode(told_by_root()));
  report::Report child;
  child.roots = {{9, 1, 2, 5, 60}};
  child.records = {{30, 0, ""}};
  hear(report::encode(child));
  ASSERT_TRUE(due_);
  run(seconds(20));
  std::set<std::uint16_t> told;
  for (const auto& sent : station_.sent) {
    const auto report = report::decode_report(sent.payload);
    ASSERT_TRUE(report);
    EXPECT_EQ(sent.ttl, 0) << "a report is never flooded";
    for (const report::Record& record : report->records) told.insert(record.node);
  }
  EXPECT_EQ(told, (std::set<std::uint16_t>{5, 30}));
}

TEST_F(AnswererTest, AReportThatWasForwardedIsNotListenedTo) {
  hear(report::encode(told_by_root()), 1);
  hear(report::encode(told_by_root()), 0, true);
  hear("R\x02");
  EXPECT_FALSE(due_);
  EXPECT_EQ(counters_.reports_unreadable, 3u);
  EXPECT_EQ(counters_.reports_received, 0u);
}

TEST_F(AnswererTest, ReportsAlsoWhereProgramsMayNotUseHarvest) {
  hub_.set_reserved({}, "robot.toml");
  hear(report::encode(told_by_root()));
  ASSERT_TRUE(due_);
  EXPECT_GE(run(seconds(20)), 1u);
}

}  // namespace
}  // namespace swarmtalk::daemon
