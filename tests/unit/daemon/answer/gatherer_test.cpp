// A hundred robots in virtual time: how much air their reports take, and what the one who looks
// gets.
#include "daemon/answer/gatherer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <set>

namespace swarmtalk::daemon {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Time = Gatherer::Time;

const Time kBeginning = Time{} + seconds(1000);
constexpr std::size_t kMostBytes = 16384;
constexpr double kBudget = 0.01;

/// Robots on a grid that hear each other up to a distance; each as a daemon would drive it.
class World {
 public:
  World(int side, double range, unsigned seed) : range_(range) {
    for (int i = 0; i < side * side; ++i) {
      robots_.push_back({std::make_unique<Gatherer>(seed + static_cast<unsigned>(i)),
                         static_cast<double>(i % side),
                         static_cast<double>(i / side),
                         {},
                         0});
    }
    for (std::size_t i = 0; i < robots_.size(); ++i) {
      for (std::size_t k = 0; k < robots_.size(); ++k) {
        if (i != k && hears(i, k)) robots_[i].heard.push_back(k);
      }
    }
  }

  static std::uint16_t id(std::size_t robot) { return static_cast<std::uint16_t>(robot + 1); }

  void look(std::size_t robot) {
    robots_[robot].gatherer->on_look(id(robot), {60, {}}, robots_[robot].heard.size(), now_);
    lookers_.insert(robot);
  }

  /// Looks again every 10 s, as viewers do.
  void run(seconds duration) {
    for (const Time end = now_ + duration; now_ < end; now_ += milliseconds(10)) {
      if ((now_ - kBeginning) % seconds(10) == seconds(0)) {
        for (const std::size_t each : lookers_) look(each);
      }
      for (std::size_t i = 0; i < robots_.size(); ++i) send(i);
    }
  }

  void transmit(std::size_t from, const std::string& bytes) {
    const auto report = report::decode_report(bytes);
    ASSERT_TRUE(report);
    const std::uint32_t air_us = AirBudget::air_us(bytes.size());
    robots_[from].air_us += air_us;
    ++messages_;
    longest_ = std::max(longest_, bytes.size());
    for (const std::size_t each : robots_[from].heard) {
      Robot& hearer = robots_[each];
      hearer.air_us += air_us;
      hearer.gatherer->on_report(id(each), id(from), *report, bytes.size(), hearer.heard.size(),
                                 now_);
      for (const report::Record& record : report->records) {
        if (record.node == id(each)) continue;
        hearer.known[record.node] = now_ - milliseconds(record.age_steps * report::kAgeStepMs);
      }
    }
  }

  /// Share of the air that the robot with the most hears and sends, since the last call.
  double take_worst_share(seconds during) {
    std::uint64_t worst = 0;
    for (Robot& robot : robots_) {
      worst = std::max(worst, robot.air_us);
      robot.air_us = 0;
    }
    return static_cast<double>(worst) / 1e6 / static_cast<double>(during.count());
  }

  /// Robots of which a viewer there knows; and the greatest age of what it knows.
  std::size_t known(std::size_t robot) const { return robots_[robot].known.size(); }
  double oldest_s(std::size_t robot) const {
    double oldest = 0;
    for (const auto& [node, said_at] : robots_[robot].known) {
      oldest = std::max(oldest, std::chrono::duration<double>(now_ - said_at).count());
    }
    return oldest;
  }
  void forget_known(std::size_t robot) { robots_[robot].known.clear(); }
  std::size_t neighbours(std::size_t robot) const { return robots_[robot].heard.size(); }
  std::size_t size() const { return robots_.size(); }
  std::size_t messages() const { return messages_; }
  std::size_t longest() const { return longest_; }
  Time now() const { return now_; }

 private:
  struct Robot {
    std::unique_ptr<Gatherer> gatherer;
    double x, y;
    std::vector<std::size_t> heard;
    std::uint64_t air_us;
    std::map<std::uint16_t, Time> known{};
  };

  bool hears(std::size_t i, std::size_t k) const {
    return std::hypot(robots_[i].x - robots_[k].x, robots_[i].y - robots_[k].y) <= range_;
  }

  void send(std::size_t i) {
    Robot& robot = robots_[i];
    if (!robot.gatherer->due() || *robot.gatherer->due() > now_) return;
    const std::string body(90, 'x');  // a robot with a pose, 16 neighbours and two channels
    const auto bytes = robot.gatherer->report(id(i), body, robot.heard.size(), kMostBytes, now_);
    if (bytes) transmit(i, *bytes);
  }

  double range_;
  std::vector<Robot> robots_;
  std::set<std::size_t> lookers_;
  Time now_ = kBeginning;
  std::size_t messages_ = 0, longest_ = 0;
};

constexpr double kOneCell = 100.0;
constexpr double kTenNeighbours = 2.0;  // 12 inside, 5 in the corners

TEST(Gatherer, NobodySpeaksWhereNobodyLooks) {
  World world(5, kOneCell, 1);
  world.run(seconds(100));
  EXPECT_EQ(world.messages(), 0u);
}

TEST(Gatherer, AHundredInOneCellAreAllKnownWithinTheBudget) {
  World world(10, kOneCell, 1);
  world.look(0);
  world.run(seconds(30));
  EXPECT_LE(world.take_worst_share(seconds(30)), kBudget) << "while it begins";
  world.run(seconds(60));
  const double share = world.take_worst_share(seconds(60));
  EXPECT_LE(share, kBudget);
  EXPECT_GE(share, kBudget / 3) << "the budget is used";
  EXPECT_EQ(world.known(0), 99u);
  EXPECT_LE(world.oldest_s(0), 12.0);
  std::printf("one cell: %.2f %% of the air, oldest %.1f s\n", share * 100, world.oldest_s(0));
}

TEST(Gatherer, AHundredWithTenNeighboursEachAreAllKnownWithinTheBudget) {
  World world(10, kTenNeighbours, 1);
  world.look(0);
  world.run(seconds(60));
  EXPECT_LE(world.take_worst_share(seconds(60)), kBudget) << "while it begins";
  world.run(seconds(120));
  const double share = world.take_worst_share(seconds(120));
  EXPECT_LE(share, kBudget);
  EXPECT_EQ(world.known(0), 99u) << "robots of which nothing came";
  EXPECT_LE(world.oldest_s(0), 45.0);
  EXPECT_LE(world.longest(), report::kMostReportBytes);
  std::printf("ten neighbours: %.2f %% of the air, oldest %.1f s\n", share * 100,
              world.oldest_s(0));
}

TEST(Gatherer, ThreeViewersTakeNoMoreThanTheBudgetAndAllAreServed) {
  World world(10, kTenNeighbours, 1);
  for (const std::size_t viewer : {std::size_t{0}, std::size_t{55}, std::size_t{99}}) {
    world.look(viewer);
  }
  world.run(seconds(180));
  EXPECT_LE(world.take_worst_share(seconds(180)), kBudget);
  for (const std::size_t viewer : {std::size_t{0}, std::size_t{55}, std::size_t{99}}) {
    EXPECT_EQ(world.known(viewer), 99u) << viewer;
  }
}

TEST(Gatherer, ReportsEndWhenNobodyLooksAnyMore) {
  Gatherer one(1);
  one.on_look(1, {5, {}}, 3, kBeginning);
  ASSERT_TRUE(one.due());
  EXPECT_FALSE(one.report(1, "x", 3, kMostBytes, kBeginning + seconds(6)));
  EXPECT_FALSE(one.due());
}

// Questions that are forged, as fast as the air lets them, do not make a robot speak more often.
TEST(Gatherer, ForgedQuestionsDoNotMakeItSpeakMoreOften) {
  Gatherer victim(7);
  Time now = kBeginning;
  std::size_t sent = 0, sent_air_us = 0;
  for (unsigned i = 0; i < 60'000; ++i, now += milliseconds(1)) {
    report::Report forged;
    forged.roots = {
        {static_cast<std::uint16_t>(100 + i % 900), static_cast<std::uint16_t>(i), 0, 0, 255}};
    const std::string bytes = report::encode(forged);
    if (i % 5 == 0) {
      victim.on_report(1, static_cast<std::uint16_t>(100 + i % 900), forged, bytes.size(), 3, now);
    }
    if (!victim.due() || *victim.due() > now) continue;
    if (const auto report = victim.report(1, std::string(90, 'x'), 3, kMostBytes, now)) {
      ++sent;
      sent_air_us += AirBudget::air_us(report->size());
    }
  }
  EXPECT_LE(static_cast<double>(sent_air_us) / 60e6, kBudget);
  EXPECT_LE(sent, 60u);
}

TEST(Gatherer, ForgedRecordsStayWithinTheTable) {
  Gatherer victim(7);
  for (unsigned i = 0; i < 5000; ++i) {
    report::Report forged;
    forged.roots = {{50, static_cast<std::uint16_t>(i), 0, 0, 255}};
    victim.on_report(1, 50, forged, 100, 3, kBeginning);
    forged.roots = {{50, 0, 2, 1, 255}};
    forged.records = {{static_cast<std::uint16_t>(i + 100), 0, std::string(250, 'x')}};
    victim.on_report(1, 60, forged, 100, 3, kBeginning);
  }
  EXPECT_EQ(victim.gathered(), Gatherer::kMostGathered);
}

}  // namespace
}  // namespace swarmtalk::daemon
