// One simulated run from scenario to log, for whichever profile and programs the caller compiles:
// swarmtalk-sim has all programs with the compared profile, a sweep's simulators one program with
// theirs. Single-threaded.
#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "suite/sim/program_main.hpp"
#include "suite/sim/simulated_run.hpp"

namespace swarmtalk::suite {

/// All integers, and the virtual seconds that were done.
inline void write_air(std::FILE* log, const sim::AirCounters& air, double seconds) {
  std::fprintf(log,
               "{\"event\":\"air\",\"seconds\":%.6f,\"sent\":%llu,\"deferred\":%llu,"
               "\"expected\":%llu,\"received\":%llu,\"lost_collision\":%llu,"
               "\"lost_while_sending\":%llu,\"lost_noise\":%llu,\"lost_jam\":%llu,"
               "\"lost_partition\":%llu,\"lost_death\":%llu,\"contacts\":%llu}\n",
               seconds, static_cast<unsigned long long>(air.sent),
               static_cast<unsigned long long>(air.deferred),
               static_cast<unsigned long long>(air.expected),
               static_cast<unsigned long long>(air.received),
               static_cast<unsigned long long>(air.lost_collision),
               static_cast<unsigned long long>(air.lost_while_sending),
               static_cast<unsigned long long>(air.lost_noise),
               static_cast<unsigned long long>(air.lost_jam),
               static_cast<unsigned long long>(air.lost_partition),
               static_cast<unsigned long long>(air.lost_death),
               static_cast<unsigned long long>(air.contacts));
}

/// Calls run(robot type, program type, world, log), the types as null pointers.
template <class Model, class Profile, class WithProgram, class Run>
void run_on(const Scenario& scenario, std::FILE* log, WithProgram with_program, Run run) {
  sim::WorldConfig config = Model::world();
  apply(scenario, config.radio, config.body, config.clock, config.faults);
  if (scenario.program == "news") check_message<Profile>(scenario);
  using Robot = platforms::ObservedRobot<platforms::WorldRobot<Model, Profile>>;
  auto* const robot = static_cast<Robot*>(nullptr);
  const bool known = with_program(robot, scenario.program,
                                  [&](auto* program) { run(robot, program, config, log); });
  if (!known) throw std::runtime_error("no program '" + scenario.program + "'");
}

/// Opens the log and calls `run` for the robot and the program that the scenario names.
/// @param log_path  "-" is none: `run` gets null @param with_program  like make.hpp's, of the
/// programs that there are
/// @throws std::exception with one line that says what is wrong
template <class Profile, class WithProgram, class Run>
void run_logged(const Scenario& scenario, const std::string& log_path, WithProgram with_program,
                Run run) {
  std::optional<LogFile> log;
  if (log_path != "-") {
    log.emplace(log_path);
    std::fprintf(log->get(), "%s\n", scenario.text.dump().c_str());
  }
  std::FILE* file = log ? log->get() : nullptr;
  if (scenario.platform == "sim-kilobot") {
    run_on<platforms::KilobotModel, Profile>(scenario, file, with_program, run);
  } else if (scenario.platform == "sim-coachbot") {
    run_on<platforms::CoachbotModel, Profile>(scenario, file, with_program, run);
  } else {
    throw std::runtime_error("no platform '" + scenario.platform +
                             "' here; there is sim-kilobot and sim-coachbot");
  }
  if (log) log->finish();
}

/// In virtual time, as fast as it goes.
template <class Profile, class WithProgram>
void run_scenario(const std::string& path, const std::string& log_path, WithProgram with_program) {
  const Scenario scenario = read_scenario(path);
  const auto run = [&](auto* robot, auto* program, const sim::WorldConfig& config, std::FILE* log) {
    using Robot = std::remove_pointer_t<decltype(robot)>;
    using Program = std::remove_pointer_t<decltype(program)>;
    auto simulation = std::make_unique<Simulation<Robot, Program>>(scenario, config, log);
    const double seconds = simulation->run([] { return stopped != 0; });
    if (log != nullptr) write_air(log, simulation->world().air(), seconds);
  };
  run_logged<Profile>(scenario, log_path, with_program, run);
}

/// SCENARIO LOG. @return the program's exit code
template <class Profile, class WithProgram>
int simulator_main(int argc, char** argv, WithProgram with_program) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: swarmtalk-sim SCENARIO LOG; see swarmtalk-suite --help\n");
    return 2;
  }
  return program_main("swarmtalk-sim", [argv, with_program] {
    run_scenario<Profile>(argv[1], argv[2], with_program);
    return 0;
  });
}

}  // namespace swarmtalk::suite
