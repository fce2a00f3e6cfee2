#include "view/reports.hpp"

#include <algorithm>

#include "report/report.hpp"

namespace swarmtalk::view {

void Reports::want(std::uint32_t robot) {
  if (robot == 0 || robot > UINT16_MAX) return;
  const auto node = static_cast<std::uint16_t>(robot);
  if (std::find(wanted_.begin(), wanted_.end(), node) != wanted_.end()) return;
  wanted_.push_back(node);
  if (wanted_.size() > report::kMostWanted) wanted_.pop_front();
  has_new_wish_ = true;
}

std::string Reports::look() {
  has_new_wish_ = false;
  return report::encode(report::Look{kLookSeconds, {wanted_.begin(), wanted_.end()}});
}

bool Reports::take(const Message& message, Swarm& swarm, Time now) {
  if (!report::is_report(message.payload)) return false;
  const auto report = report::decode_report(message.payload);
  if (!report) return true;
  for (const report::Record& record : report->records) {
    const auto facts = report::decode_body(record.body);
    if (!facts) continue;
    const auto age = std::chrono::milliseconds(record.age_steps * report::kAgeStepMs);
    swarm.note_report(record.node, *facts, now - age);
  }
  return true;
}

}  // namespace swarmtalk::view
