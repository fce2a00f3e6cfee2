#include "daemon/answer/look_tree.hpp"

#include <algorithm>

namespace swarmtalk::daemon {

void LookTree::forget_old(Time now) {
  std::erase_if(entries_, [&](const Entry& entry) { return entry.until <= now; });
}

LookTree::Entry* LookTree::entry_for(std::uint16_t root, Time now) {
  forget_old(now);
  for (Entry& entry : entries_) {
    if (entry.node == root) return &entry;
  }
  if (entries_.size() >= report::kMostRoots) return nullptr;
  entries_.emplace_back().node = root;
  return &entries_.back();
}

void LookTree::look(std::uint16_t self, const report::Look& look, Time now) {
  Entry* const entry = entry_for(self, now);
  if (entry == nullptr) return;
  entry->parent = 0;
  entry->depth = 0;
  entry->until = now + std::chrono::seconds(std::min(look.seconds, kMostSeconds));
  entry->wanted = look.wanted;
}

void LookTree::heard(std::uint16_t self, std::uint16_t sender, const report::Report& report,
                     Time now) {
  for (const report::Root& root : report.roots) {
    if (root.node == self || root.parent == self || root.seconds == 0) continue;
    if (root.depth >= kMostDepth) continue;
    Entry* const entry = entry_for(root.node, now);
    if (entry == nullptr) continue;
    const bool is_new = entry->until == Time{};
    const auto ahead = static_cast<std::int16_t>(root.number - entry->number);
    const std::uint8_t depth = static_cast<std::uint8_t>(root.depth + 1);
    const bool is_nearer = ahead == 0 && depth < entry->depth;
    if (!is_new && ahead <= 0 && !is_nearer) continue;
    entry->number = root.number;
    entry->depth = depth;
    entry->parent = sender;
    entry->until = now + std::chrono::seconds(std::min(root.seconds, kMostSeconds));
    entry->wanted = report.wanted;
  }
}

bool LookTree::is_looked_at(Time now) {
  forget_old(now);
  return !entries_.empty();
}

bool LookTree::is_child(std::uint16_t self, const report::Report& report) const {
  return std::any_of(report.roots.begin(), report.roots.end(), [&](const report::Root& root) {
    const auto is_passed_on = [&](const Entry& entry) {
      return entry.node == root.node && entry.depth > 0;  // at the root it has arrived
    };
    return root.parent == self && std::any_of(entries_.begin(), entries_.end(), is_passed_on);
  });
}

std::vector<report::Root> LookTree::roots(std::uint16_t self, Time now) {
  forget_old(now);
  std::vector<report::Root> roots;
  for (Entry& entry : entries_) {
    if (entry.node == self) ++entry.number;
    const auto left = std::chrono::ceil<std::chrono::seconds>(entry.until - now).count();
    roots.push_back({entry.node, entry.number, entry.depth, entry.parent,
                     static_cast<std::uint8_t>(std::min<std::int64_t>(left, kMostSeconds))});
  }
  return roots;
}

std::vector<std::uint16_t> LookTree::wanted(Time now) {
  forget_old(now);
  std::vector<std::uint16_t> all;
  for (const Entry& entry : entries_) {
    for (const std::uint16_t node : entry.wanted) {
      const bool is_new = std::find(all.begin(), all.end(), node) == all.end();
      if (is_new && all.size() < report::kMostWanted) all.push_back(node);
    }
  }
  return all;
}

bool LookTree::is_wanted(std::uint16_t self, Time now) {
  const std::vector<std::uint16_t> all = wanted(now);
  return std::find(all.begin(), all.end(), self) != all.end();
}

}  // namespace swarmtalk::daemon
