#include "lab/lab.hpp"

#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <swarmtalk/client.hpp>
#include <thread>
#include <utility>

#include "lab/interrupt.hpp"
#include "lab/medium.hpp"
#include "lab/network_namespace.hpp"
#include "lab/robot_config.hpp"

namespace swarmtalk::lab {
namespace {

using namespace std::chrono_literals;

constexpr auto kStartTimeout = 20s;
constexpr auto kStartTimeoutElsewhere = 180s;  // an emulated processor
constexpr auto kEndGrace = 3s;
constexpr auto kOthersTimeout = 30s;  // for the keeper of a lab that was killed

bool answers(const State& state, const Robot& robot) {
  if (const Medium& medium = medium_named(state.medium); medium.is_elsewhere()) {
    return output_of(medium.as_robot(state, robot, {"test", "-S", robot.socket})).exit_code == 0;
  }
  swarmtalk::ClientOptions options;
  options.socket_path = robot.socket;
  options.connect_timeout = 200ms;
  swarmtalk::Client client("swarmtalk-lab", options);
  return client.connect().ok();
}

void wait_until_up(const State& state) {
  const bool is_elsewhere = medium_named(state.medium).is_elsewhere();
  const auto deadline =
      std::chrono::steady_clock::now() + (is_elsewhere ? kStartTimeoutElsewhere : kStartTimeout);
  for (const Robot& robot : state.robots) {
    while (!answers(state, robot)) {
      throw_if_interrupted();
      const std::string who = "robot " + std::to_string(robot.number) + ": swarmtalkd ";
      if (!is_running(robot.daemon)) {
        throw std::runtime_error(who + "ended: " + last_words(robot));
      }
      if (std::chrono::steady_clock::now() > deadline) {
        throw std::runtime_error(who + "does not answer at " + robot.socket + "; see " + robot.log);
      }
      std::this_thread::sleep_for(10ms);
    }
  }
}

void start_daemon(const State& state, Robot& robot, const LabOptions& options) {
  std::ofstream file(robot.config);
  file << robot_config(state, robot, options.base_config);
  file.close();
  if (!file) throw std::runtime_error("cannot write " + robot.config);
  SpawnOptions spawn_options;
  spawn_options.network_namespace = robot.network_namespace;
  spawn_options.output_file = robot.log;
  spawn_options.detached = true;
  spawn_options.dies_with_parent = options.dies_with_parent;
  spawn_options.write_down = [&](const ProcessId& daemon) {
    robot.daemon = daemon;
    save(state);
  };
  spawn(
      medium_named(state.medium).as_robot(state, robot, {options.daemon, "--config", robot.config}),
      spawn_options);
}

void check(const LabOptions& options) {
  if (const std::string problem = medium_named(options.medium).problem(); !problem.empty()) {
    throw std::runtime_error(problem);
  }
  if (find_program(options.daemon).empty()) {
    throw std::runtime_error("no program " + options.daemon +
                             "; name swarmtalkd with --daemon PATH");
  }
}

void refuse_if_alive(const State& state) {
  if (!is_alive(state)) return;
  throw std::runtime_error("a lab called '" + state.name +
                           "' is up; take it down with `swarmtalk-lab " + name_option(state.name) +
                           "down` or use another --name");
}

/// Calls `attempt` until it returns true.
void wait_for_others(const std::string& name, const std::function<bool()>& attempt) {
  const auto deadline = std::chrono::steady_clock::now() + kOthersTimeout;
  while (!attempt()) {
    throw_if_interrupted();
    if (std::chrono::steady_clock::now() > deadline) {
      throw std::runtime_error("another swarmtalk-lab is busy with the lab '" + name +
                               "' and does not end; use another --name");
    }
    std::this_thread::sleep_for(10ms);
  }
}

/// The folder of a new lab, where there is nothing else.
FolderLock make_folder(const std::string& name) {
  std::optional<FolderLock> lock;
  wait_for_others(name, [&] {
    State existing;
    if (load(name, existing)) refuse_if_alive(existing);
    std::filesystem::create_directories(folder_of(name));
    lock = FolderLock::try_take(name);
    if (!lock || !load(name, existing)) return lock.has_value();
    refuse_if_alive(existing);
    down(existing);  // left behind by a tool that was killed, and the folder with it
    return false;
  });
  return std::move(*lock);
}

State plan(const LabOptions& options) {
  State state;
  state.name = options.name;
  state.medium = options.medium;
  state.radio = options.radio;
  state.wifi_mode = options.wifi_mode;
  const auto folder = folder_of(options.name);
  state.keeper = identify(getpid());
  for (int number = 1; number <= options.robots; ++number) {
    Robot robot;
    robot.number = number;
    const std::string name = "robot-" + std::to_string(number);
    robot.socket = folder / (name + ".sock");
    robot.config = folder / (name + ".toml");
    robot.log = folder / (name + ".log");
    robot.pose = grid_pose(number, options.robots, options.spacing_m);
    state.robots.push_back(robot);
  }
  medium_named(state.medium).plan(state);
  return state;
}

}  // namespace

std::string name_option(const std::string& name) {
  return name == kDefaultName ? "" : "--name " + name + " ";
}

std::string last_words(const Robot& robot) {
  std::ifstream file(robot.log);
  std::string line;
  std::string last = "it wrote nothing to its log";
  while (std::getline(file, line)) {
    if (!line.empty()) last = line;
  }
  return last;
}

Pose grid_pose(int robot_number, int robots, double spacing_m) {
  const int columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(robots))));
  const int index = robot_number - 1;
  return {spacing_m * (index % columns), spacing_m * (index / columns), 0};
}

State up(const LabOptions& options, Keeper& keeper) {
  check(options);
  keeper.begin(
      options.name, [&] { return make_folder(options.name); },
      options.dies_with_parent ? "the run that it belonged to was killed"
                               : "its start was ended before all robots were up");
  forget_word(options.name);
  State state = plan(options);
  try {
    save(state);
    medium_named(state.medium).make(state);
    save(state);
    for (Robot& robot : state.robots) {
      throw_if_interrupted();
      start_daemon(state, robot, options);
    }
    wait_until_up(state);
    if (!options.dies_with_parent) {
      state.keeper = {};
      save(state);  // from here on the lab stays
      keeper.release();
    }
  } catch (...) {
    down(state);
    keeper.release();
    throw;
  }
  keeper.wait_for_no_helpers();
  return state;
}

bool is_alive(const State& state) {
  // Its daemons may be a moment slower to end.
  if (state.keeper.pid != 0) return is_running(state.keeper);
  for (const Robot& robot : state.robots) {
    if (is_running(robot.daemon)) return true;
  }
  return false;
}

bool is_left_behind(const State& state) {
  return state.keeper.pid != 0 && !is_running(state.keeper);
}

void take_down_left_behind(const std::string& name) {
  wait_for_others(name, [&] {
    State state;
    if (!load(name, state)) return true;
    const auto lock = FolderLock::try_take(name);
    if (lock && load(name, state)) down(state);
    return lock.has_value();
  });
}

void down(const State& state) {
  std::vector<ProcessId> processes;
  for (const Robot& robot : state.robots) {
    processes.push_back(robot.daemon);
    for (const ProcessId& process : processes_in(robot.network_namespace)) {
      if (process.pid != getpid()) processes.push_back(process);
    }
  }
  end_processes(processes, kEndGrace);
  std::vector<ProcessId> of_medium = state.medium_processes;
  // One of them takes down a lab that has lost the others.
  std::erase_if(of_medium, [](const ProcessId& process) { return process.pid == getpid(); });
  end_processes(of_medium, kEndGrace);
  medium_named(state.medium).remove(state);
  forget(state);
}

std::vector<Robot> select_robots(const State& state, const std::string& list) {
  if (list == "all") return state.robots;
  const int count = static_cast<int>(state.robots.size());
  std::vector<Robot> selected;
  std::istringstream parts(list);
  for (std::string part; std::getline(parts, part, ',');) {
    int first = 0;
    int last = 0;
    char rest = 0;
    const int fields = std::sscanf(part.c_str(), "%d-%d%c", &first, &last, &rest);
    if (fields == 1 && part.find_first_not_of("0123456789") == std::string::npos)
      last = first;
    else if (fields != 2) {
      throw std::runtime_error("'" + list + "' names no robot; use a number, 1,4-6 or all");
    }
    if (first < 1 || last > count || first > last) {
      throw std::runtime_error("'" + part + "' is not in this lab; it has robots 1 to " +
                               std::to_string(count));
    }
    for (int number = first; number <= last; ++number) {
      selected.push_back(state.robots[static_cast<std::size_t>(number - 1)]);
    }
  }
  if (selected.empty()) throw std::runtime_error("name a robot: a number, 1,4-6 or all");
  return selected;
}

std::vector<std::string> environment_of(const State& state, const Robot& robot) {
  std::vector<std::string> environment{"SWARMTALK_SOCKET=" + robot.socket,
                                       "SWARMTALK_ROBOT=" + std::to_string(robot.number),
                                       "SWARMTALK_LAB=" + state.name};
  if (!state.control_socket.empty()) {
    environment.push_back("SWARMTALK_MEDIUM=" + state.control_socket);
  }
  return environment;
}

}  // namespace swarmtalk::lab
