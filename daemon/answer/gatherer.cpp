#include "daemon/answer/gatherer.hpp"

#include <algorithm>
#include <vector>

namespace swarmtalk::daemon {
namespace {

using std::chrono::microseconds;

constexpr std::uint32_t kAtOnce = 1000;  // of random thousandths

std::uint8_t age_steps(Gatherer::Time said_at, Gatherer::Time now) {
  const auto age = std::chrono::duration_cast<std::chrono::milliseconds>(now - said_at).count();
  const auto steps = std::max<std::int64_t>(age, 0) / report::kAgeStepMs;
  return static_cast<std::uint8_t>(std::min<std::int64_t>(steps, 255));
}

}  // namespace

void Gatherer::on_look(std::uint16_t self, const report::Look& look, std::size_t neighbours,
                       Time now) {
  tree_.look(self, look, now);
  plan(neighbours, now);
}

void Gatherer::on_report(std::uint16_t self, std::uint16_t sender, const report::Report& report,
                         std::size_t bytes, std::size_t neighbours, Time now) {
  budget_.heard(sender, AirBudget::air_us(bytes), report.round_air_steps * report::kAirStepUs, now);
  tree_.heard(self, sender, report, now);
  if (tree_.is_child(self, report)) {
    for (const report::Record& record : report.records) gather(self, record, now);
  }
  plan(neighbours, now);
}

// The first report comes at random within a period, so that those who hear of it do not answer all
// at once; each later one a period after the one before, and never earlier whatever is asked.
void Gatherer::plan(std::size_t neighbours, Time now) {
  if (due_ || !tree_.is_looked_at(now)) return;
  const microseconds period = budget_.period(neighbours, now);
  const Time first = now + period * (random_() % kAtOnce) / kAtOnce;
  due_ = reported_at_ ? std::max(first, *reported_at_ + period) : first;
}

void Gatherer::gather(std::uint16_t self, const report::Record& record, Time now) {
  if (record.node == self || record.age_steps == 255) return;
  const Time said_at = now - std::chrono::milliseconds(record.age_steps * report::kAgeStepMs);
  const auto found = gathered_.find(record.node);
  if (found == gathered_.end() && gathered_.size() >= kMostGathered) {
    forget_old(now);
    if (gathered_.size() >= kMostGathered) return;
  }
  Gathered& entry = gathered_[record.node];
  // The same again by another way: its age is known to a step only.
  const auto step = std::chrono::milliseconds(report::kAgeStepMs);
  if (entry.said_at != Time{} && said_at <= entry.said_at + step) return;
  entry.body = record.body;
  entry.said_at = said_at;
  if (!entry.is_waiting) entry.turn = ++turns_;
  entry.is_waiting = true;
}

void Gatherer::forget_old(Time now) {
  std::erase_if(gathered_,
                [&](const auto& entry) { return now - entry.second.said_at > kOldestRecord; });
}

std::optional<std::string> Gatherer::report(std::uint16_t self, const std::string& body,
                                            std::size_t neighbours, std::size_t most_bytes,
                                            Time now) {
  due_.reset();
  if (!tree_.is_looked_at(now)) {
    gathered_.clear();
    return std::nullopt;
  }
  const microseconds period = budget_.period(neighbours, now);
  if (reported_at_ && now < *reported_at_ + period) {  // it has become longer meanwhile
    due_ = *reported_at_ + period;
    return std::nullopt;
  }
  report::Report report;
  report.wanted = tree_.wanted(now);
  const std::uint32_t steps =
      (budget_.round_us(neighbours, now) + report::kAirStepUs - 1) / report::kAirStepUs;
  report.round_air_steps = static_cast<std::uint16_t>(std::min<std::uint32_t>(steps, UINT16_MAX));
  report.roots.resize(report::kMostRoots);  // as many as there can be, for the size
  report.records.push_back({self, 0, body});
  add_gathered(report, std::min(most_bytes, report::kMostReportBytes), now);
  report.roots = tree_.roots(self, now);
  std::string bytes = report::encode(report);
  const std::uint32_t air_us = AirBudget::air_us(bytes.size());
  if (!budget_.has_room(air_us, now)) {
    for (std::size_t i = 1; i < report.records.size(); ++i) {
      gathered_[report.records[i].node].is_waiting = true;  // in its old turn
    }
    due_ = now + period / 4;
    return std::nullopt;
  }
  budget_.sent(air_us, now);
  reported_at_ = now;
  due_ = now + period + period * (random_() % kAtOnce) / kAtOnce / 8;
  return bytes;
}

void Gatherer::add_gathered(report::Report& report, std::size_t most_bytes, Time now) {
  forget_old(now);
  std::vector<std::pair<std::uint64_t, std::uint16_t>> waiting;
  for (const auto& [node, entry] : gathered_) {
    if (entry.is_waiting) waiting.emplace_back(entry.turn, node);
  }
  std::sort(waiting.begin(), waiting.end());
  std::size_t size = report::encode(report).size();
  for (const auto& [turn, node] : waiting) {
    Gathered& entry = gathered_[node];
    report::Record record{node, age_steps(entry.said_at, now), entry.body};
    if (size + report::size_of(record) > most_bytes) break;
    size += report::size_of(record);
    entry.is_waiting = false;
    report.records.push_back(std::move(record));
  }
}

}  // namespace swarmtalk::daemon
