// The keys of a [links.NAME] section of type "kilobot": plain values with their defaults and
// limits, and how they are read. docs/kilobot.md explains them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "frame/air_frame.hpp"
#include "kilobot_bridge/kilobot_link.hpp"

namespace swarmtalk::daemon {

class TableReader;

struct KilobotConfig {
  std::string downlink;            // the overhead controller's serial device; empty: none
  std::string uplink;              // the gateway's; may be the same; empty: none
  bool is_text = false;            // the uplink brings lines of text
  std::uint16_t text_channel = 0;  // with is_text: where they are published, on this daemon
  bool ohc_single = false;
  std::uint32_t baud = 38400;
  std::uint32_t copies = 3;
  std::uint32_t settle_ms = 3500;
  double time_scale = 1.0;

  bool operator==(const KilobotConfig&) const = default;
};

/// The keys of the section, "type" and "profile" too.
std::vector<std::string> kilobot_keys();

/// Checks the keys and reads all but "type" and "node_id".
/// @throws ConfigError
void read_kilobot(const TableReader& table, KilobotConfig& config, frame::ProfileId& profile);

kilobot_bridge::KilobotLinkConfig kilobot_link_config(const KilobotConfig& config,
                                                      frame::ProfileId profile);

}  // namespace swarmtalk::daemon
