// What the lab remembers between two calls of the tool: one folder per lab with a JSON file, each
// robot's configuration, log and socket.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lab/process.hpp"
#include "lab/radio_settings.hpp"

namespace swarmtalk::lab {

struct Pose {
  double x_m = 0;
  double y_m = 0;
  double theta_rad = 0;
};

struct Robot {
  int number = 0;                 // from 1
  std::string network_namespace;  // empty: none of its own (medium udp)
  std::string socket;
  std::string config;
  std::string log;
  Pose pose;
  ProcessId daemon;
};

struct State {
  std::string name;
  std::string medium;
  std::string wifi_mode;      // of medium wifi: ap, ap-isolated, ibss or mesh
  std::string hub_namespace;  // holds the bridge; empty: none
  ProcessId keeper;           // the `run`, or `up` that has not ended; pid 0: stays until `down`
  std::vector<Robot> robots;
  RadioSettings radio;                      // of the medium radio
  std::string control_socket;               // where the medium is told things; empty: nowhere
  std::vector<ProcessId> medium_processes;  // of a medium that has any
};

/// Folder of the lab called `name`: below /run/swarmtalk-lab for root, else below
/// $XDG_RUNTIME_DIR if this user may write there, else below /tmp in a folder of this user.
std::filesystem::path folder_of(const std::string& name);

/// @return false when there is no such lab. Throws when its file cannot be read.
bool load(const std::string& name, State& state);

/// Writes it as a whole or not at all.
void save(const State& state);

/// Leaves word why a lab ended by itself, for who asks for it next; until a lab of this name
/// begins. The first word stays: what ends after that ends for this reason.
void leave_word(const std::string& name, const std::string& why);

/// That word; empty: none was left.
std::string last_word(const std::string& name);
void forget_word(const std::string& name);

/// Removes the lab's folder, and nothing else of it.
void forget(const State& state);

/// Who runs a lab of this name that is not ours, as far as one can see; empty: nobody.
std::string owner_of_other_lab(const std::string& name);

/// Processes of a lab of this user's, wherever its folder is: below another $XDG_RUNTIME_DIR, or
/// nowhere any more, as after a logout.
struct Elsewhere {
  std::filesystem::path folder;      // empty: there is none
  std::vector<ProcessId> processes;  // its daemons, and its medium's
  bool is_folder_there = false;
};
Elsewhere find_elsewhere(const std::string& name);

/// From here on labs are looked for where this one is.
void look_in(const std::filesystem::path& folder);

/// Names of the labs this user has, running or left behind.
std::vector<std::string> list_labs();

}  // namespace swarmtalk::lab
