// Lab: N robots on one machine, each an unmodified swarmtalkd with a pose on a grid, joined by a
// medium. Brings them up, runs commands as one of them, and takes everything down again.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/keeper.hpp"
#include "lab/state.hpp"

namespace swarmtalk::lab {

inline constexpr int kMaxRobots = 250;

inline constexpr const char* kDefaultName = "lab";

/// What a command line needs so that it is about the lab called `name`; ends with a blank.
std::string name_option(const std::string& name);

struct LabOptions {
  std::string name = kDefaultName;
  std::string medium;            // one of medium_names()
  RadioSettings radio;           // of the medium radio
  std::string wifi_mode = "ap";  // of the medium wifi
  std::string daemon;            // path of swarmtalkd
  std::string base_config;       // TOML file for all robots; empty: as installed
  double spacing_m = 0.5;        // of the grid of poses
  int robots = 0;
  bool dies_with_parent = false;  // the lab ends when this process does, however it ends
};

/// Brings a lab up and waits until each daemon answers.
/// @param keeper  begins here; released once the lab stays by itself, or everything is taken down
/// Throws std::runtime_error with one line when it cannot, with everything taken down again.
State up(const LabOptions& options, Keeper& keeper);

/// Ends the lab's processes and removes its namespaces and its folder. Safe on half a lab.
void down(const State& state);

/// The last line that a robot's daemon wrote to its log, for a daemon that has ended.
std::string last_words(const Robot& robot);

/// True while the `run` that owns this lab runs, or the `up` that makes it; of a lab that stays by
/// itself, while any daemon does.
bool is_alive(const State& state);

/// Whether this is half a lab: its `up` or `run` was killed, and its keeper with it or not yet
/// done.
bool is_left_behind(const State& state);

/// Takes down what is left behind of the lab called `name`, or waits until its keeper has done so.
/// Throws std::runtime_error when that does not come to its end.
void take_down_left_behind(const std::string& name);

/// Robots named by `list`: "3", "1,4-6" or "all". Throws when one is not in the lab.
std::vector<Robot> select_robots(const State& state, const std::string& list);

/// What a command run as this robot finds in its environment (SWARMTALK_SOCKET and others).
std::vector<std::string> environment_of(const State& state, const Robot& robot);

/// Runs `command` as each of `robots` at once and waits. With several robots each line of output
/// comes as a whole, with the robot's number in front if `with_prefix`.
/// @return 0, or the first exit code that is not 0.
int run_in_robots(const State& state, const std::vector<Robot>& robots,
                  const std::vector<std::string>& command, bool with_prefix);

/// Robots on a square grid from (0, 0), row by row, all heading along +x.
Pose grid_pose(int robot_number, int robots, double spacing_m);

}  // namespace swarmtalk::lab
