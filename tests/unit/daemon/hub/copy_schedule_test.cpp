#include "daemon/hub/copy_schedule.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

using std::chrono::milliseconds;
constexpr CopySchedule::Time kNoon{};

TEST(CopySchedule, TellsTheHookOnlyWhatComesEarlierThanAllThatWait) {
  CopySchedule schedule;
  std::vector<CopySchedule::Time> told;
  schedule.set_hook([&](CopySchedule::Time at) { told.push_back(at); });
  schedule.add({kNoon + milliseconds(20), 1, 0, 5});
  schedule.add({kNoon + milliseconds(30), 2, 0, 5});
  schedule.add({kNoon + milliseconds(10), 3, 0, 5});
  EXPECT_EQ(told, (std::vector{kNoon + milliseconds(20), kNoon + milliseconds(10)}));
}

TEST(CopySchedule, GivesOutWhatIsDueAndKeepsTheRest) {
  CopySchedule schedule;
  schedule.add({kNoon + milliseconds(10), 1, 0, 5});
  schedule.add({kNoon + milliseconds(20), 2, 0, 5});
  const auto due = schedule.take(kNoon + milliseconds(10));
  ASSERT_EQ(due.size(), 1u);
  EXPECT_EQ(due[0].channel, 1);
  std::vector<CopySchedule::Time> told;
  schedule.set_hook([&](CopySchedule::Time at) { told.push_back(at); });
  schedule.tell_next();
  EXPECT_EQ(told, std::vector{kNoon + milliseconds(20)});
  EXPECT_EQ(schedule.take(kNoon + milliseconds(20)).size(), 1u);
  schedule.tell_next();
  EXPECT_EQ(told.size(), 1u);
}

}  // namespace
}  // namespace swarmtalk::daemon
