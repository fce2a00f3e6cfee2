#include "daemon/config/config_changes.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace swarmtalk::daemon {
namespace {

constexpr std::array<std::string_view, 6> kSections{"node.", "channels.", "limits.",
                                                    "log.",  "metrics.",  "reserved."};
// Of these sections what is used up at start.
constexpr std::array<std::string_view, 7> kAtStartOnly{"limits.tracked_senders",
                                                       "limits.requests_per_user_hz",
                                                       "limits.changes_per_user_hz",
                                                       "limits.changes_burst",
                                                       "node.name",
                                                       "node.pose_socket",
                                                       "reserved.report"};
constexpr std::array<std::string_view, 14> kLinkKeys{
    "rate_hz",       "burst_frames",     "jitter_us",
    "beacon_ms",     "air_rate_mbps",    "key_file",
    "also_key_file", "virtual_range_m",  "virtual_range_unknown",
    "forward",       "max_forward_ttl",  "max_forward_wait_ms",
    "ghosts",        "forward_jitter_us"};

/// Whether `key` is of a link that only one of the two has.
bool is_of_new_or_gone_link(const std::string& key, const KeyLines& before, const KeyLines& after) {
  if (!key.starts_with("links.")) return false;
  const std::string type = key.substr(0, key.rfind('.')) + ".type";
  return before.values().contains(type) != after.values().contains(type);
}

}  // namespace

bool applies_on_reload(const std::string& key) {
  const std::string_view text = key;
  if (std::find(kAtStartOnly.begin(), kAtStartOnly.end(), text) != kAtStartOnly.end()) return false;
  for (const std::string_view section : kSections) {
    if (text.starts_with(section)) return true;
  }
  if (!text.starts_with("links.")) return false;
  const std::string_view last = text.substr(text.rfind('.') + 1);
  return std::find(kLinkKeys.begin(), kLinkKeys.end(), last) != kLinkKeys.end();
}

ConfigChanges compare(const KeyLines& before, const KeyLines& after) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : after.values()) {
    const auto old = before.values().find(key);
    if (old == before.values().end() || old->second != value) keys.push_back(key);
  }
  for (const auto& [key, value] : before.values()) {
    if (!after.values().contains(key)) keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end());
  ConfigChanges changes;
  for (const std::string& key : keys) {
    if (after.is_option(key)) continue;
    const bool applies = applies_on_reload(key) && !is_of_new_or_gone_link(key, before, after);
    (applies ? changes.applied : changes.need_restart).push_back(key);
  }
  return changes;
}

}  // namespace swarmtalk::daemon
