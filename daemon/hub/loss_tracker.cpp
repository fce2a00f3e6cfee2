#include "daemon/hub/loss_tracker.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::daemon {
namespace {

/// Takes from `gap` what was dropped since the source's last message and not explained yet.
std::uint64_t take(std::uint64_t& gap, std::uint64_t before, std::uint64_t now,
                   std::uint64_t& explained) {
  const std::uint64_t since = now - std::min(before, now);
  const std::uint64_t unexplained = now - std::min(explained, now);
  const std::uint64_t taken = std::min({gap, since, unexplained});
  explained += taken;
  gap -= taken;
  return taken;
}

constexpr std::uint64_t kPaceNs = 100'000'000;  // shorter times say nothing of a rate
constexpr double kNsPerS = 1e9;

}  // namespace

void LossTracker::Pace::note(std::uint32_t number, std::uint64_t now_ns) {
  if (!has_heard) {
    begin = heard = number;
    begin_ns = heard_ns = now_ns;
    has_heard = true;
    return;
  }
  const std::uint32_t ahead = number - heard;
  if (ahead == 0 || ahead > UINT32_MAX / 2) return;
  heard = number;
  heard_ns = std::max(heard_ns, now_ns);
  const std::uint64_t passed_ns = std::max(heard_ns - begin_ns, kPaceNs);
  most_hz = std::max(
      most_hz, static_cast<double>(number - begin) * kNsPerS / static_cast<double>(passed_ns));
  if (passed_ns == kPaceNs) return;
  begin = heard;
  begin_ns = heard_ns;
}

bool LossTracker::Pace::believes(std::uint32_t number, std::uint64_t now_ns) const {
  const auto since_ns = static_cast<double>(now_ns - std::min(now_ns, heard_ns));
  return number - heard <= kBelieved + kBelievedTimesRate * most_hz * since_ns / kNsPerS;
}

// Null: it is followed from now on, from this number.
LossTracker::Entry* LossTracker::find(const Source& source, std::uint32_t number,
                                      const DropTotals& drops) {
  if (!entries_.empty() && entries_.front().source == source) return &entries_.front();
  const auto found = sources_.find(source);
  if (found == sources_.end()) {
    if (sources_.size() >= max_sources_) {
      ++evicted_;
      sources_.erase(entries_.back().source);
      entries_.pop_back();
    }
    entries_.push_front({source, number, false, {}, drops, {}});
    sources_.emplace(source, entries_.begin());
    return nullptr;
  }
  entries_.splice(entries_.begin(), entries_, found->second);
  return &*found->second;
}

// The highest number is `ahead` more now; those between, and the old one if it did not come, are
// missing.
void LossTracker::advance(Entry& entry, std::uint32_t ahead) {
  const std::size_t step = std::min<std::size_t>(ahead, kWindow);
  entry.missing <<= step;
  for (std::size_t i = 0; i + 1 < step; ++i) entry.missing.set(i);
  if (entry.is_highest_missing || ahead - 1 >= kWindow) entry.missing.set(step - 1);
  entry.highest += ahead;
  entry.is_highest_missing = false;
}

Loss LossTracker::note(const Source& source, std::uint32_t number, const DropTotals& drops,
                       std::uint64_t now_ns) {
  Entry* const known = find(source, number, drops);
  Entry& entry = entries_.front();
  const bool is_first = !entry.pace.has_heard;
  entry.pace.note(number, now_ns);
  if (known == nullptr) return {};
  if (is_first && number - entry.highest > UINT32_MAX / 2) {
    entry = {source, number, false, {}, drops, entry.pace};  // only beacons have told of more
    return {};
  }
  const std::uint32_t ahead = number - entry.highest;  // wraps as the numbers do
  Loss loss;
  if (ahead == 0) {
    loss.late = std::exchange(entry.is_highest_missing, false) ? 1 : 0;
  } else if (ahead - 1 <= kLongestGap) {
    advance(entry, ahead);
    loss = locate(entry, ahead - 1, drops);
    entry.drops = drops;
  } else if (const std::uint32_t behind = entry.highest - number; behind - 1 < kWindow) {
    if (entry.missing.test(behind - 1)) loss.late = 1;
    entry.missing.reset(behind - 1);
  } else if (behind - 1 > kLongestGap) {
    entry = {source, number, false, {}, drops, {}};
    entry.pace.note(number, now_ns);
  }
  return loss;
}

// A beacon that is behind what has come was overtaken.
Loss LossTracker::note_last(const Source& source, std::uint32_t number, const DropTotals& drops,
                            std::uint64_t now_ns) {
  Entry* const entry = find(source, number, drops);
  if (entry == nullptr) {
    entries_.front().pace.heard = number;  // what follows is measured from here
    entries_.front().pace.heard_ns = now_ns;
    return {};
  }
  const std::uint32_t ahead = number - entry->highest;
  if (ahead == 0 || ahead > UINT32_MAX / 2) return {};
  if (!entry->pace.believes(number, now_ns)) {
    ++disbelieved_;
    return {};
  }
  advance(*entry, ahead);
  entry->is_highest_missing = true;
  const Loss loss = locate(*entry, ahead, drops);
  entry->drops = drops;
  return loss;
}

Loss LossTracker::locate(const Entry& entry, std::uint64_t gap, const DropTotals& drops) {
  Loss loss;
  if (gap == 0) return loss;
  loss.kernel = take(gap, entry.drops.kernel, drops.kernel, explained_.kernel);
  loss.daemon = take(gap, entry.drops.node, drops.node, explained_.node);
  loss.air = gap;
  return loss;
}

void LossTracker::forget(std::uint16_t channel) {
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    if (entry->source.channel != channel) {
      ++entry;
      continue;
    }
    sources_.erase(entry->source);
    entry = entries_.erase(entry);
  }
}

}  // namespace swarmtalk::daemon
