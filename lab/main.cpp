// swarmtalk-lab: many robots on one machine.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "lab/air_commands.hpp"
#include "lab/interrupt.hpp"
#include "lab/keeper.hpp"
#include "lab/lab.hpp"
#include "lab/map_command.hpp"
#include "lab/medium.hpp"
#include "lab/network_namespace.hpp"
#include "lab/radio_medium.hpp"
#include "lab/status.hpp"
#include "usage/checks.hpp"
#include "usage/mistakes.hpp"
#include "usage/usage.hpp"

namespace {

using namespace swarmtalk::lab;

constexpr int kExitUsage = 2;
constexpr auto kCommandGrace = std::chrono::seconds(5);

/// swarmtalkd beside this program: in the build tree or installed; else from PATH's usual places.
std::string find_daemon() {
  const std::filesystem::path here = own_folder();
  for (const auto& path : {here / "../daemon/swarmtalkd", here / "../sbin/swarmtalkd",
                           std::filesystem::path("/usr/sbin/swarmtalkd"),
                           std::filesystem::path("/usr/local/sbin/swarmtalkd")}) {
    if (access(path.c_str(), X_OK) == 0) return std::filesystem::weakly_canonical(path);
  }
  return "swarmtalkd";
}

bool is_up(const std::string& name) {
  State state;
  try {
    return load(name, state) && is_alive(state);
  } catch (const std::runtime_error&) {
    return false;
  }
}

std::string orphans(const std::string& name, const Elsewhere& lab) {
  const std::size_t count = lab.processes.size();
  return std::to_string(count) + (count == 1 ? " process" : " processes") + " of the lab '" + name +
         "' still run" + (count == 1 ? "s" : "") + ", and its folder " + lab.folder.string() +
         " was deleted; end " + (count == 1 ? "it" : "them") + " with `swarmtalk-lab " +
         name_option(name) + "down`";
}

State load_or_throw(const std::string& name) {
  State state;
  if (load(name, state)) return state;
  if (const Elsewhere lab = find_elsewhere(name); lab.is_folder_there) {
    look_in(lab.folder);
    if (load(name, state)) return state;
  } else if (!lab.folder.empty()) {
    throw std::runtime_error(orphans(name, lab));
  }
  if (const std::string owner = owner_of_other_lab(name); !owner.empty()) {
    throw std::runtime_error("the lab '" + name + "' belongs to " + owner +
                             "; use it as that user" +
                             (owner == "root" ? " (`" + with_sudo() + "`)" : "") +
                             ", or start one of your own: swarmtalk-lab up 9 --medium udp");
  }
  if (const std::string why = last_word(name); !why.empty()) {
    forget_word(name);  // it is told once
    throw std::runtime_error("the lab '" + name + "' was taken down: " + why +
                             "; start it anew with `swarmtalk-lab up N`");
  }
  std::string text = "no lab called '" + name + "' is up; start one with `swarmtalk-lab up N`";
  const auto others = list_labs();
  if (!others.empty()) {
    text += others.size() == 1 ? " (there is:" : " (there are:";
    for (const auto& other : others) text += " " + other + (is_up(other) ? "" : " (left behind)");
    text += "; choose with --name)";
  }
  throw std::runtime_error(text);
}

/// What is left of a lab whose folder was deleted. @return whether there was anything
bool end_orphans(const std::string& name) {
  State state;
  if (load(name, state)) return false;
  const Elsewhere lab = find_elsewhere(name);
  if (lab.is_folder_there) return false;
  end_processes(lab.processes, kCommandGrace);
  const std::vector<std::string> namespaces = namespaces_of(name);
  for (const std::string& each : namespaces) {
    end_processes(processes_in(each), kCommandGrace);
    remove_namespace(each);
  }
  return !lab.folder.empty() || !namespaces.empty();
}

/// Before a lab is made. @throws std::runtime_error  something is left of one of that name
void look_for_orphans(const std::string& name) {
  const Elsewhere lab = find_elsewhere(name);
  if (lab.is_folder_there) return look_in(lab.folder);
  if (!lab.folder.empty()) throw std::runtime_error(orphans(name, lab));
  State state;
  if (load(name, state) || namespaces_of(name).empty()) return;
  throw std::runtime_error(
      "network namespaces of a lab '" + name + "' are left, whose folder was " +
      "deleted; remove them with `swarmtalk-lab " + name_option(name) + "down`");
}

/// Waits for the command, passing on a termination that only this process got.
int wait_for(pid_t child) {
  int status = 0;
  bool told = false;
  auto deadline = std::chrono::steady_clock::time_point::max();
  for (;;) {
    const pid_t result = waitpid(child, &status, WNOHANG);
    if (result == child) return exit_code(status);
    if (result < 0 && errno != EINTR) return 1;
    if (interrupted() != 0 && !told) {
      told = true;
      // A terminal's Ctrl-C reaches the command by itself; a second one does no harm.
      kill(child, interrupted());
      deadline = std::chrono::steady_clock::now() + kCommandGrace;
    }
    if (std::chrono::steady_clock::now() > deadline) kill(child, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

int run(LabOptions options, const std::vector<std::string>& command) {
  options.dies_with_parent = true;
  Keeper keeper;
  const State state = up(options, keeper);
  int result = 1;
  try {
    SpawnOptions spawn_options;
    spawn_options.environment = {"SWARMTALK_LAB=" + state.name};
    if (!state.control_socket.empty()) {
      spawn_options.environment.push_back("SWARMTALK_MEDIUM=" + state.control_socket);
    }
    spawn_options.dies_with_parent = true;
    result = wait_for(spawn(command, spawn_options));
  } catch (...) {
    down(state);
    keeper.release();
    throw;
  }
  down(state);
  keeper.release();
  return result;
}

/// What `up` ends with.
std::string is_up_text(const State& state) {
  const std::string lab = "swarmtalk-lab " + name_option(state.name);
  const bool has_map = !medium_named(state.medium).is_elsewhere() && !find_view().empty();
  return std::to_string(state.robots.size()) +
         (state.robots.size() == 1 ? " robot is" : " robots are") + " up. Try: " + lab +
         "exec 1 -- swarmtalk-cli neighbours\n" + (has_map ? "Their map: " + lab + "view\n" : "");
}

/// Options of a start that the medium would not heed.
void check_medium(const CLI::App& app, const CLI::App& command, const std::string& medium) {
  const bool is_radio = medium.starts_with("radio");
  const auto refuse = [&](const char* name, bool is_heeded, const char* whose) {
    if (is_heeded || app.get_option(name)->count() + command.get_option(name)->count() == 0) return;
    throw CLI::ValidationError(std::string(name) + " is for --medium " + whose + ", not " + medium);
  };
  for (const char* name : {"--range", "--loss", "--rate"}) refuse(name, is_radio, "radio");
  refuse("--wifi-mode", medium == "wifi", "wifi");
}

/// Whether the command to run stands where `--` should come first: not a misspelt option of ours.
bool begins_with_command(const CLI::App& app, int own_arguments, char** argv) {
  const std::vector<std::string> unknown = app.remaining(true);
  for (int i = 1; i < own_arguments; ++i) {
    const std::string word = argv[i];
    if (std::find(unknown.begin(), unknown.end(), word) == unknown.end()) continue;
    return !word.starts_with('-');
  }
  return true;  // its words were taken for ours
}

/// "run 3 -- COMMAND", with the robots that were given.
std::string with_dashes(const CLI::App& command, const char* robots, const char* usual) {
  const CLI::Option* given = command.get_option(robots);
  return command.get_name() + " " + (given->count() > 0 ? given->results().front() : usual) +
         " -- COMMAND";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Many robots on one machine: each an unmodified swarmtalkd in a network namespace "
      "of its own, with a pose on a grid.",
      "swarmtalk-lab"};
  app.require_subcommand(1);
  app.fallthrough();  // --name behind the verb, too
  swarmtalk::usage::prepare(app, SWARMTALK_VERSION);
  LabOptions options;
  options.daemon = find_daemon();
  app.add_option("--name", options.name,
                 "Name of the lab, when there are several; else that in SWARMTALK_LAB")
      ->envname("SWARMTALK_LAB")
      ->check([](const std::string& name) {
        const bool good =
            !name.empty() && name.size() <= 32 &&
            name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string::npos;
        return good ? std::string() : std::string("use at most 32 of a-z 0-9 _ -");
      });

  auto add_lab_options = [&](CLI::App* command) {
    command
        ->add_option("--medium", options.medium,
                     "bridge: namespaces and raw layer-2 frames (root); radio: the same, through a "
                     "simulated Wi-Fi channel with range, loss and collisions; radio-udp: that "
                     "channel without namespaces (anybody); udp: the UDP link, without namespaces "
                     "(anybody); wifi: simulated 802.11 radios in a virtual machine (anybody). "
                     "Without root: udp, and radio-udp for radio")
        ->check(CLI::IsMember(medium_names()))
        ->default_str("bridge");
    command
        ->add_option(
            "--wifi-mode", options.wifi_mode,
            "Of the medium wifi: clients of an access point, of one that keeps them apart, "
            "an ad hoc cell, 802.11s")
        ->check(CLI::IsMember({"ap", "ap-isolated", "ibss", "mesh"}))
        ->capture_default_str();
    command->add_option("--spacing", options.spacing_m, "Metres between robots on the grid")
        ->check(swarmtalk::usage::between(0, 30))
        ->capture_default_str();
    command
        ->add_option("--range", options.radio.range_m,
                     "Of the medium radio: metres that a frame reaches at 6 Mb/s")
        ->check(swarmtalk::usage::between(0.01, 10000))
        ->capture_default_str();
    command
        ->add_option("--loss", options.radio.loss,
                     "Of the medium radio: share of receptions that fail, 0 to 1")
        ->check(swarmtalk::usage::between(0, 1))
        ->capture_default_str();
    command
        ->add_option("--rate", options.radio.rate_mbps,
                     "Of the medium radio: Mb/s of broadcasts; faster ones do not reach as far")
        ->check(CLI::IsMember({6, 9, 12, 18, 24, 36, 48, 54}))
        ->capture_default_str();
    command
        ->add_option(
            "--config", options.base_config,
            "TOML file that all robots get instead of the installed one; the lab puts in each "
            "robot's socket, link, pose and id (an id of \"auto\" stays)")
        ->check(CLI::ExistingFile);
    command->add_option("--daemon", options.daemon, "Path of swarmtalkd")->type_name("FILE");
  };

  // The same before the verb, hidden there: only `up` and `run` have a use for them.
  add_lab_options(&app);
  const std::vector<std::string> early_options{"--medium", "--wifi-mode", "--spacing", "--range",
                                               "--loss",   "--rate",      "--config",  "--daemon"};
  for (const std::string& name : early_options) app.get_option(name)->group("");
  auto add_start_options = [&](CLI::App* command) {
    command->add_option("ROBOTS", options.robots, "How many robots")
        ->required()
        ->check(swarmtalk::usage::whole_number(kMaxRobots, 1));
    add_lab_options(command);
  };

  std::vector<std::string> command_line;
  std::string robot_list;
  bool as_json = false;
  bool no_prefix = false;
  CLI::App* up_command = app.add_subcommand("up", "Start robots and leave them running");
  add_start_options(up_command);
  bool with_map = false;
  up_command->add_flag("--view", with_map, "Then show their map, as `swarmtalk-lab view` does");
  CLI::App* run_command =
      app.add_subcommand("run", "Start robots, run the command after --, take everything down");
  add_start_options(run_command);
  CLI::App* exec_command = app.add_subcommand(
      "exec", "Run the command after -- as robot I, several (1,4-6) or all at once");
  exec_command->add_option("I", robot_list, "Robot: a number, 1,4-6 or all")->required();
  exec_command->add_flag("--no-prefix", no_prefix,
                         "With several robots: do not put the robot's number before each line");
  std::string map_robot = "1";
  CLI::App* view_command = app.add_subcommand(
      "view",
      "Show the map of the lab in a browser, with all that one robot's daemon knows; what "
      "stands after -- goes to swarmtalk-view");
  view_command->add_option("ROBOT", map_robot, "Whose")
      ->check(swarmtalk::usage::whole_number(kMaxRobots, 1))
      ->capture_default_str();
  CLI::App* status_command = app.add_subcommand("status", "Show the robots of the lab");
  status_command->add_flag("--json", as_json, "One JSON object a line");
  CLI::App* down_command = app.add_subcommand("down", "Take the lab down");
  const AirCommands air_commands(app);
  std::string kept_socket;  // says in a list of processes whose keeper it is
  CLI::App* keep_command =
      app.add_subcommand("keep", "Run the medium of a lab; done by up and run");
  keep_command->add_option("SOCKET", kept_socket)->required();
  keep_command->group("");  // hidden
  swarmtalk::usage::add_help_command(app);
  // Everything behind the first -- is the command's, also what looks like an option of ours.
  int own_arguments = 1;
  while (own_arguments < argc && std::string(argv[own_arguments]) != "--") ++own_arguments;
  for (int i = own_arguments + 1; i < argc; ++i) command_line.emplace_back(argv[i]);
  try {
    app.parse(own_arguments, argv);
    if ((*run_command || *exec_command) && command_line.empty()) {
      throw CLI::RequiredError("-- COMMAND");
    }
    const bool takes_more = *run_command || *exec_command || *view_command || with_map;
    if (!takes_more && !command_line.empty()) {
      throw CLI::ValidationError("nothing is run here, so nothing may stand after --");
    }
    for (const std::string& name : early_options) {
      if (app.get_option(name)->count() == 0 || *up_command || *run_command) continue;
      throw CLI::ValidationError(name + " is for up and run");
    }
    std::string why;
    options.medium = choose_medium(options.medium, why);
    if (*up_command) check_medium(app, *up_command, options.medium);
    if (*run_command) check_medium(app, *run_command, options.medium);
    if ((*up_command || *run_command) && !why.empty()) {
      why += ", so the robots talk over the UDP link (" + options.medium + ")";
      if (geteuid() != 0) why += "; with `" + with_sudo() + "` each has a network of its own";
      std::fprintf(stderr, "swarmtalk-lab: %s\n", why.c_str());
    }
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    const CLI::App* chosen =
        app.get_subcommands().empty() ? nullptr : app.get_subcommands().front();
    const bool has_more = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr ||
                          app.get_subcommands().size() > 1;
    const bool is_without_dashes =
        (chosen == run_command || chosen == exec_command) && has_more &&
        (own_arguments == argc || begins_with_command(app, own_arguments, argv));
    if (is_without_dashes) {
      std::fprintf(stderr, "swarmtalk-lab: put -- before the command: swarmtalk-lab %s\n",
                   (chosen == exec_command ? with_dashes(*chosen, "I", "1")
                                           : with_dashes(*chosen, "ROBOTS", "9"))
                       .c_str());
    } else {
      const std::string mistake = swarmtalk::usage::mistake(app, error, own_arguments, argv);
      std::fprintf(stderr, "swarmtalk-lab: %s\n",
                   swarmtalk::usage::with_help(mistake, "swarmtalk-lab --help").c_str());
    }
    return kExitUsage;
  }

  try {
    if (*keep_command) {
      return keep_medium(options.name, [&] { return serve_radio(load_or_throw(options.name)); });
    }
    remember_interrupts();
    if (*up_command || *run_command) look_for_orphans(options.name);
    if (*up_command) {
      Keeper keeper;
      const State made = up(options, keeper);
      std::fputs(is_up_text(made).c_str(), stdout);
      std::fflush(stdout);
      return with_map ? show_map(made, made.robots.front(), command_line) : 0;
    }
    if (*run_command) return run(options, command_line);
    if (*down_command && end_orphans(options.name)) return 0;
    const State state = load_or_throw(options.name);
    if (is_left_behind(state)) {
      if (!*down_command) {
        throw std::runtime_error("the up or run that made the lab '" + options.name +
                                 "' was killed, and this is half a lab; remove it with " +
                                 "`swarmtalk-lab " + name_option(options.name) + "down`");
      }
      take_down_left_behind(options.name);
      return 0;
    }
    if (*exec_command) {
      return run_in_robots(state, select_robots(state, robot_list), command_line, !no_prefix);
    }
    if (*view_command) {
      return show_map(state, select_robots(state, map_robot).front(), command_line);
    }
    if (air_commands.is_chosen()) return air_commands.run(state);
    if (*status_command) return print_status(state, as_json);
    if (*down_command) down(state);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "swarmtalk-lab: %s\n", error.what());
    return 1;
  }
}
