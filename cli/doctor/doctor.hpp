// `swarmtalk-cli doctor`: why robots do not hear each other, and what to do about it. And `survey`:
// loss, delay and signal by distance.
#pragma once

#include <string>
#include <vector>

#include "cli/common/commands.hpp"
#include "cli/doctor/facts.hpp"
#include "cli/doctor/peer.hpp"

namespace CLI {
class App;
}

namespace swarmtalk::cli::doctor {

struct DoctorArguments {
  double seconds = 2;  // that counters are watched
  bool has_fix = false;
  std::string interface;    // besides those of the daemon's links; empty: none
  std::string config_file;  // where no daemon runs
  Expected expected;
  PeerArguments peer;  // robot 0: this robot only
};

/// Adds `doctor` to `app`; `verb` is set when the user has written it.
void add_doctor(CLI::App& app, Common& common, Verb& verb);

/// @return kExitOk: healthy. kExitFailure: findings, that --fix has not removed. kExitUsage: none,
///   but something could not be looked at
int doctor(const Common& common, const DoctorArguments& arguments);

}  // namespace swarmtalk::cli::doctor
