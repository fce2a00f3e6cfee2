// The command line of ghosts: --join TARGET [--first-id N] SCENARIO LOG.
#pragma once

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "suite/sim/ghosts.hpp"
#include "suite/sim/run_scenario.hpp"

namespace swarmtalk::suite {

inline constexpr const char* kGhostUsage =
    "usage: swarmtalk-sim --join TARGET [--first-id N] SCENARIO LOG; TARGET is a network "
    "interface, or the socket of a lab's radio (SWARMTALK_MEDIUM)\n";

/// @return false: not a whole number from 1 to what node ids go to
template <class Profile>
bool read_first_id(const char* text, uint16_t& id) {
  constexpr unsigned long kLast = core::Wire<Profile>::kNoNode - 1;
  char* end = nullptr;
  errno = 0;
  const unsigned long number = std::strtoul(text, &end, 10);
  if (errno != 0 || end == text || *end != 0 || number < 1 || number > kLast) return false;
  id = static_cast<uint16_t>(number);
  return true;
}

template <class Profile, class WithProgram>
void run_ghosts(const GhostSettings& settings, const std::string& path, const std::string& log_path,
                WithProgram with_program) {
  const Scenario scenario = read_scenario(path);
  const std::size_t last = settings.first_id + scenario.robots.size() - 1;
  // From 248 on they are gateways' (docs/wire-format.md).
  constexpr std::size_t kLastId = 247;
  if (scenario.robots.empty() || last > kLastId) {
    throw std::runtime_error("ghosts would have node ids " + std::to_string(settings.first_id) +
                             " to " + std::to_string(last) +
                             "; there is 1 to 247: fewer ghosts, "
                             "or another --first-id");
  }
  const auto run = [&](auto* robot, auto* program, const sim::WorldConfig& config, std::FILE* log) {
    using Robot = std::remove_pointer_t<decltype(robot)>;
    using Program = std::remove_pointer_t<decltype(program)>;
    Ghosts<Robot, Program> ghosts(scenario, config, settings, log);
    const double seconds = ghosts.run([] { return stopped != 0; });
    const std::string report = ghosts.report(seconds).dump();
    std::printf("%s\n", report.c_str());
    if (log != nullptr) std::fprintf(log, "{\"event\":\"ghosts\",%s\n", report.c_str() + 1);
  };
  run_logged<Profile>(scenario, log_path, with_program, run);
}

/// @return the program's exit code
template <class Profile, class WithProgram>
int ghosts_main(int argc, char** argv, WithProgram with_program) {
  GhostSettings settings;
  int next = 2;
  if (argc > next) settings.target = argv[next++];
  bool is_right = !settings.target.empty();
  if (argc > next + 1 && std::strcmp(argv[next], "--first-id") == 0) {
    is_right = is_right && read_first_id<Profile>(argv[next + 1], settings.first_id);
    next += 2;
  }
  if (!is_right || argc != next + 2) {
    std::fputs(kGhostUsage, stderr);
    return 2;
  }
  return program_main("swarmtalk-sim", [&] {
    run_ghosts<Profile>(settings, argv[next], argv[next + 1], with_program);
    return 0;
  });
}

}  // namespace swarmtalk::suite
