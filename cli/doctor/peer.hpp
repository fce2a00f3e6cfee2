// The test between two robots: questions and answers of `ping` (docs/wire-format.md) through both
// daemons and the air. What came, when and how, as plain values, and what that says.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/common/commands.hpp"
#include "cli/doctor/facts.hpp"
#include "cli/doctor/finding.hpp"

namespace swarmtalk::cli::doctor {

struct PeerArguments {
  std::uint32_t robot = 0;  // node id
  std::string address;      // its IP address or name; empty: not known
  std::string report_file;  // what `doctor --json` printed there; empty: none; "-": stdin
  std::uint32_t questions = 75;
  double period_s = 0.04;  // between two: not a part or multiple of a beacon's 102.4 ms
};

/// What the other robot says of itself, from its own `doctor --json`.
struct PeerReport {
  bool hears_us = false;
  std::string version;
  std::string mode, network, bssid;  // empty: not a radio, or not told
  std::uint32_t frequency_mhz = 0;   // 0: not told
  std::uint32_t ethertype = 0;       // 0: not told
  std::uint32_t mtu_bytes = 0;       // of its interface under raw_l2; 0: not told
};

struct PeerFacts {
  std::uint32_t robot = 0;
  std::uint64_t asked = 0;
  std::uint64_t heard_there = 0;  // of our questions, as it says
  std::uint64_t answered = 0;
  std::vector<double> arrivals_ms;  // of its answers, on one clock
  std::vector<double> round_trips_ms;
  std::uint64_t frames = 0;          // of its own that our link has just heard
  std::uint64_t unicast_frames = 0;  // of these, sent to our address instead of to all
  std::uint64_t broadcast_frames = 0;
  bool is_captured = false;  // whether the two above are known
  std::optional<int> signal_dbm;
  std::string link;                // by which it is heard
  std::optional<bool> is_reached;  // by IP; none: nobody told its address
  std::optional<PeerReport> report;
};

/// Asks the robot, for about three seconds. @return of a failure its text
Status test_peer(const Common& common, const PeerArguments& arguments, PeerFacts& facts);

/// @return none: it is not the output of `doctor --json`
std::optional<PeerReport> read_report(const nlohmann::ordered_json& json, std::uint32_t own_node);

/// The same of a file's text. @param problem  if there is none: why, to go after the file's name
std::optional<PeerReport> read_report(std::string_view text, std::uint32_t own_node,
                                      std::string& problem);

/// Whether something at this address answers by TCP: a connection, or that it is refused.
/// @return none: the address has no meaning here. Waits at most four seconds
std::optional<bool> is_reached(const std::string& address);

void diagnose_peer(const PeerFacts& peer, const Facts& own, Report& report);

/// Whether frames come only just after beacons: their times folded on the beacon interval lie
/// together (mean resultant length; Mardia and Jupp, Directional Statistics, 2.3.1).
/// @param arrivals_ms  at least 10, on one clock
/// @param interval_ms  of beacons
bool comes_with_beacons(const std::vector<double>& arrivals_ms, double interval_ms);

}  // namespace swarmtalk::cli::doctor
