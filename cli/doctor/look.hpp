// Looking at this robot: kernel, daemon, clock. What cannot be asked stays empty in the facts.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/common/commands.hpp"
#include "cli/doctor/facts.hpp"
#include "ipc/ipc.pb.h"
#include "nl80211/asker.hpp"

namespace swarmtalk::cli::doctor {

/// Interface, and what 802.11 tells of it. @param asker  null: this kernel has no 802.11
InterfaceFacts look_at_interface(const std::string& name, nl80211::Asker* asker);

/// @return none: 802.11 knows nothing of it
std::optional<RadioFacts> look_at_radio(nl80211::Asker& asker, unsigned index);

/// Interfaces of this machine that are radios.
std::vector<std::string> radios();

/// Asks the daemon twice, `seconds` apart, so that counters that rise are seen.
/// @param config_file  looked at with `swarmtalkd --check` where the daemon does not run
DaemonFacts look_at_daemon(const Common& common, double seconds, const std::string& config_file);

/// Serial devices of the daemon's links, and which other programs have them open.
std::vector<SerialFacts> look_at_serial_devices(const DaemonFacts& daemon);

/// Whether the kernel's clock is kept right by somebody.
std::optional<ClockFacts> look_at_clock();

/// A daemon's answers as facts.
void take_status(const ipc::Status& first, const ipc::Status& second, DaemonFacts& facts);
void take_neighbours(const ipc::Neighbours& neighbours, DaemonFacts& facts);

}  // namespace swarmtalk::cli::doctor
