// What doctor has seen of this robot, as plain values: gathered by look_at_*.cpp, judged by
// diagnose.hpp. An empty optional was not told, or does not apply.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "interface/interface_info.hpp"
#include "nl80211/radio.hpp"

namespace swarmtalk::cli::doctor {

/// A radio's state, of an interface that is one.
struct RadioFacts {
  nl80211::Interface interface;
  std::optional<nl80211::Network> network;
  std::optional<std::vector<nl80211::Station>> stations;
  std::optional<bool> power_save;
  std::optional<std::string> country;
};

struct InterfaceFacts : InterfaceInfo {
  bool has_ipv4_address = true;
  std::optional<RadioFacts> radio;  // if it is one, unless it cannot be asked
};

struct LinkFacts {
  std::string name;
  std::string type;       // raw_l2, udp, replay, kilobot
  std::string device;     // interface, group, file, or serial devices
  std::string interface;  // empty: none
  bool is_up = false;
  std::string state;
  std::size_t packet_bytes = 0;        // longest of the profile
  std::size_t packet_limit_bytes = 0;  // that the interface's MTU lets through
  std::uint32_t ethertype = 0;
  bool is_sealed = false;
  double air_rate_mbps = 0;  // configured; 0: not
  std::optional<std::uint32_t> forward_jitter_us;
  std::uint64_t packets_forwarded = 0;  // since the daemon started
  std::optional<std::uint64_t> asked_buffer_bytes;
  std::uint64_t given_buffer_bytes = 0;
  std::uint32_t node_id = 0;
  // How much each has risen while doctor looked.
  std::map<std::string, std::uint64_t> rises;
};

struct NeighbourFacts {
  std::string link;
  std::uint32_t node_id = 0;
  std::string address;
  std::uint64_t frames = 0;
  std::uint64_t age_ms = 0;
  bool is_duplicate = false;
  std::optional<int> signal_dbm;
  bool is_ghost = false;
  double loss = 0;                // share of its frames that did not come lately
  std::uint32_t loss_frames = 0;  // of which that is the share
};

/// What to type for a daemon: as the service of this machine, or as another (a lab's, one by hand).
struct DaemonWords {
  std::string cli = "swarmtalk-cli";
  std::string start = "sudo systemctl restart swarmtalkd";  // one that has ended
  std::string restart = start;
  std::string log = "`journalctl -u swarmtalkd`";
};
/// @param socket  on which it is asked
DaemonWords words_for(const std::string& socket);

struct DaemonFacts {
  enum class State { kRuns, kAbsent, kDead, kNoPermission, kOther };
  State state = State::kRuns;
  std::string trouble;  // what connecting said, with its remedy
  DaemonWords words;
  std::string version;
  std::uint32_t node_id = 0;
  bool is_id_fixed = false;
  std::string node_id_source;
  std::optional<std::string> id_trouble;  // why its rule would give none at a start now
  std::uint64_t id_collisions = 0;        // with our own id, while doctor looked
  std::string config_file;
  std::optional<std::string> config_error;  // of the file as it is now
  bool is_config_compared = false;          // with what is in force
  std::vector<std::string> config_reload;   // keys that a reload would apply
  std::vector<std::string> config_restart;  // keys that need a restart
  std::vector<LinkFacts> links;
  std::vector<NeighbourFacts> neighbours;
};

/// A serial device of a link.
struct SerialFacts {
  std::string path;
  std::string others;    // programs beside the daemon that have it open: "pid 123 (cat)"
  bool are_all = false;  // that have it, are known
};

struct ClockFacts {
  bool is_synchronised = false;
};

struct Facts {
  DaemonFacts daemon;
  std::vector<InterfaceFacts> interfaces;
  std::vector<SerialFacts> serial_devices;
  std::optional<ClockFacts> clock;
  std::string cli_version;
  double seconds = 0;  // that counters were watched
};

/// What the user says it should be; empty or 0: anything.
struct Expected {
  std::string network;
  std::string mode;  // nl80211::word_of()
  int channel = 0;
  std::string country;
};

}  // namespace swarmtalk::cli::doctor
