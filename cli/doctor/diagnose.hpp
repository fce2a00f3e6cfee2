// From what was seen to what is wrong. No input or output: tests hold every finding against facts
// that have just this one fault.
#pragma once

#include <cstddef>

#include "cli/doctor/facts.hpp"
#include "cli/doctor/finding.hpp"

namespace swarmtalk::cli::doctor {

/// Signals below are weak: at 1 to 6 Mb/s a receiver needs about -90 dBm, and 15 dB more so that
/// bodies and fading do not cut it (802.11-2020, table 17-18: -82 dBm at 6 Mb/s).
inline constexpr int kWeakSignalDbm = -75;
/// A broadcast of 100 bytes takes 1.7 ms at 1 Mb/s and 0.3 ms at 6 Mb/s.
inline constexpr double kLeastBroadcastMbps = 5.5;

/// Of Ethernet and Wi-Fi, and the longest frame that a link sends.
inline constexpr std::size_t kUsualMtuBytes = 1500;

/// All of this robot.
void diagnose(const Facts& facts, const Expected& expected, Report& report);

// Parts of it.
void diagnose_daemon(const Facts& facts, Report& report);
void diagnose_address(const Facts& facts, const LinkFacts& link, Report& report);
void diagnose_serial_device(const SerialFacts& device, Report& report);
void diagnose_losses(const Facts& facts, const LinkFacts& link, Report& report);
void diagnose_link(const LinkFacts& link, const DaemonFacts& daemon, Report& report);
/// @return whether something was found that explains a link that is down
bool diagnose_interface(const InterfaceFacts& interface, const LinkFacts* link,
                        const DaemonWords& words, Report& report);
/// @return likewise
bool diagnose_radio(const InterfaceFacts& interface, const LinkFacts* link,
                    const Expected& expected, Report& report);

/// A robot that is heard on this link from the address of this robot's own interface; null: none.
const NeighbourFacts* double_of(const Facts& facts, const LinkFacts& link);

/// 0x020000000001 as "02:00:00:00:00:01".
std::string address_text(std::uint64_t address);

}  // namespace swarmtalk::cli::doctor
