#include "daemon/hub/copy_schedule.hpp"

#include <algorithm>

namespace swarmtalk::daemon {

void CopySchedule::add(const Due& copy) {
  const bool is_first = std::all_of(waiting_.begin(), waiting_.end(),
                                    [&](const Due& other) { return copy.at < other.at; });
  waiting_.push_back(copy);
  if (is_first) hook_(copy.at);
}

std::vector<CopySchedule::Due> CopySchedule::take(Time now) {
  std::vector<Due> due;
  std::erase_if(waiting_, [&](const Due& copy) {
    if (copy.at <= now) due.push_back(copy);
    return copy.at <= now;
  });
  return due;
}

void CopySchedule::tell_next() const {
  const auto next = std::min_element(waiting_.begin(), waiting_.end(),
                                     [](const auto& a, const auto& b) { return a.at < b.at; });
  if (next != waiting_.end()) hook_(next->at);
}

}  // namespace swarmtalk::daemon
