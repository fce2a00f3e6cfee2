// Which keys differ between two readings of the configuration, and which of them apply without a
// restart. The one place that says so; docs/configuration.md repeats it for each key, and a test
// compares the two.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/config_error.hpp"

namespace swarmtalk::daemon {

struct ConfigChanges {
  std::vector<std::string> applied;  // full keys: "links.wifi.rate_hz"
  std::vector<std::string> need_restart;
};

/// Keys whose values differ, came or went. Those given on the command line are left out: the file
/// does not decide them.
ConfigChanges compare(const KeyLines& before, const KeyLines& after);

/// @param key  full: "links.wifi.rate_hz"
bool applies_on_reload(const std::string& key);

}  // namespace swarmtalk::daemon
