#include "daemon/hub/loss_tracker.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::daemon {
namespace {

/// What was dropped after `before`, and after all that is explained.
std::uint64_t since(std::uint64_t before, std::uint64_t explained, std::uint64_t now) {
  return now - std::min(std::max(before, explained), now);
}

/// Takes from `gap` what was dropped since the source's last message and not explained yet.
std::uint64_t take(std::uint64_t& gap, std::uint64_t before, std::uint64_t now,
                   std::uint64_t& explained) {
  const std::uint64_t taken = std::min(gap, since(before, explained, now));
  explained += taken;
  gap -= taken;
  return taken;
}

}  // namespace

// Null: it is not followed yet.
LossTracker::Entry* LossTracker::find(const Source& source) {
  if (!entries_.empty() && entries_.front().source == source) return &entries_.front();
  const auto found = sources_.find(source);
  if (found == sources_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found->second);
  return &*found->second;
}

void LossTracker::follow(const Source& source, const DropTotals& drops,
                         const FollowedCount& count) {
  if (sources_.size() >= max_sources_) {
    ++evicted_;
    sources_.erase(entries_.back().source);
    entries_.pop_back();
  }
  entries_.push_front({source, count, drops, false, false, false, {}, {}});
  sources_.emplace(source, entries_.begin());
}

// What was dropped here since the source's last message, and not put down to another gap.
std::uint64_t LossTracker::unexplained(const Entry& entry, const DropTotals& drops) const {
  return since(entry.drops.kernel, explained_.kernel, drops.kernel) +
         since(entry.drops.node, explained_.node, drops.node);
}

// The highest number is `ahead` more now. Those between, and the old one if it did not come, are
// missing: the oldest as far as that is believed.
void LossTracker::advance(Entry& entry, std::uint32_t ahead, std::uint32_t believed) {
  if (ahead == 1 && !entry.has_missing && !entry.has_doubted && !entry.is_highest_missing) return;
  const std::size_t step = std::min<std::size_t>(ahead, kWindow);
  const std::size_t between = ahead - 1 >= kWindow ? step : step - 1;
  const std::size_t doubted = std::min<std::size_t>(ahead - 1 - believed, between);
  entry.missing <<= step;
  for (std::size_t i = doubted; i < between; ++i) entry.missing.set(i);
  if (entry.is_highest_missing && between < step) entry.missing.set(step - 1);
  entry.is_highest_missing = false;
  entry.has_missing = entry.missing.any();
  if (!entry.has_doubted && doubted == 0) return;
  entry.doubted <<= step;
  for (std::size_t i = 0; i < doubted; ++i) entry.doubted.set(i);
  entry.has_doubted = entry.doubted.any();
}

// The number so far below the highest came. @return whether it was counted as lost
bool LossTracker::take_back(Entry& entry, std::uint32_t behind) {
  bool was_missing = false;
  if (behind == 0) {
    was_missing = std::exchange(entry.is_highest_missing, false);
  } else {
    was_missing = entry.missing.test(behind - 1);
    entry.missing.reset(behind - 1);
    entry.doubted.reset(behind - 1);
  }
  if (was_missing) entry.count.came_late();
  return was_missing;
}

// The highest number is so much less now. @return how many above and at it were counted as lost: it
// has come, and they are counted again if they do not come.
std::uint32_t LossTracker::go_back(Entry& entry, std::uint32_t behind) {
  const std::size_t step = std::min<std::size_t>(behind, kWindow);
  const auto above = static_cast<std::uint32_t>((entry.missing << (kWindow - step)).count());
  entry.missing >>= step;
  entry.has_missing = entry.missing.any();
  return above + (std::exchange(entry.is_highest_missing, false) ? 1 : 0);
}

// The oldest of those doubted, as far as they are believed meanwhile. @return how many
std::uint32_t LossTracker::believe_now(Entry& entry) {
  const std::uint32_t believed =
      entry.count.believe_now(static_cast<std::uint32_t>(entry.doubted.count()));
  std::uint32_t told = 0;
  for (std::size_t i = kWindow; i-- > 0 && told < believed;) {
    if (!entry.doubted.test(i)) continue;
    entry.doubted.reset(i);
    entry.missing.set(i);
    entry.has_missing = true;
    ++told;
  }
  entry.has_doubted = entry.doubted.any();
  return told;
}

Loss LossTracker::note(const Source& source, std::uint32_t number, const DropTotals& drops,
                       std::uint64_t now_ns) {
  Entry* const entry = find(source);
  if (entry == nullptr) {
    follow(source, drops, FollowedCount(number, now_ns, true));
    return {};
  }
  const FollowedCount::Step step = entry->count.heard(number, unexplained(*entry, drops), now_ns);
  Loss loss;
  switch (step.place) {
    case FollowedCount::Place::kAhead: {
      if (step.believed < step.distance - 1) ++doubted_;
      advance(*entry, step.distance, step.believed);
      std::uint32_t told = step.believed;
      if (entry->has_doubted) told += believe_now(*entry);
      loss = locate(*entry, told, drops);
      entry->drops = drops;
      break;
    }
    case FollowedCount::Place::kBehind:
      loss.late = take_back(*entry, step.distance) ? 1 : 0;
      break;
    case FollowedCount::Place::kBack:
      loss.late = go_back(*entry, step.distance);
      break;
    case FollowedCount::Place::kElsewhere:
      entry->missing.reset();
      entry->doubted.reset();
      entry->is_highest_missing = entry->has_missing = entry->has_doubted = false;
      loss = locate(*entry, step.believed, drops);
      entry->drops = drops;
      break;
    case FollowedCount::Place::kDoubted:
      ++doubted_;
      break;
  }
  return loss;
}

// A beacon that is behind what has come was overtaken.
Loss LossTracker::note_last(const Source& source, std::uint32_t number, const DropTotals& drops,
                            std::uint64_t now_ns) {
  Entry* const entry = find(source);
  if (entry == nullptr) {
    follow(source, drops, FollowedCount(number, now_ns, false));
    return {};
  }
  const FollowedCount::Step step = entry->count.told(number, now_ns);
  if (step.place == FollowedCount::Place::kDoubted) ++disbelieved_;
  if (step.place != FollowedCount::Place::kAhead) return {};
  advance(*entry, step.distance, step.distance - 1);
  entry->is_highest_missing = true;
  const Loss loss = locate(*entry, step.distance, drops);
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
