// swarmtalk-sim SCENARIO LOG: one simulated run. Called by swarmtalk-suite, which makes scenarios
// and reads logs. LOG "-" is none. Ctrl-C ends the run with what it has.
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "suite/sim/program_main.hpp"
#include "suite/sim/simulated_run.hpp"

namespace {

using namespace swarmtalk;

/// All integers, and the real seconds that were done.
void write_air(std::FILE* log, const sim::AirCounters& air, double seconds) {
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

template <class Robot, class Program>
void run(const suite::Scenario& scenario, const sim::WorldConfig& config, std::FILE* log) {
  auto simulation = std::make_unique<suite::Simulation<Robot, Program>>(scenario, config, log);
  const double seconds = simulation->run([] { return suite::stopped != 0; });
  if (log != nullptr) write_air(log, simulation->world().air(), seconds);
}

template <class Model>
void run_on(const suite::Scenario& scenario, std::FILE* log) {
  sim::WorldConfig config = Model::world();
  suite::apply(scenario, config.radio, config.body, config.clock, config.faults);
  using Plain = platforms::WorldRobot<Model>;
  using Robot = platforms::ObservedRobot<Plain>;
  const bool known = suite::with_program<Robot>(scenario.program, [&](auto* program) {
    run<Robot, std::remove_pointer_t<decltype(program)>>(scenario, config, log);
  });
  if (!known) throw std::runtime_error("no program '" + scenario.program + "'");
}

void run_scenario(const std::string& path, const std::string& log_path) {
  const suite::Scenario scenario = suite::read_scenario(path);
  std::optional<suite::LogFile> log;
  if (log_path != "-") {
    log.emplace(log_path);
    std::fprintf(log->get(), "%s\n", scenario.text.dump().c_str());
  }
  std::FILE* file = log ? log->get() : nullptr;
  if (scenario.platform == "sim-kilobot") {
    run_on<platforms::KilobotModel>(scenario, file);
  } else if (scenario.platform == "sim-coachbot") {
    run_on<platforms::CoachbotModel>(scenario, file);
  } else {
    throw std::runtime_error("no platform '" + scenario.platform +
                             "' here; there is sim-kilobot and sim-coachbot");
  }
  if (log) log->finish();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: swarmtalk-sim SCENARIO LOG; see swarmtalk-suite --help\n");
    return 2;
  }
  return suite::program_main("swarmtalk-sim", [argv] {
    run_scenario(argv[1], argv[2]);
    return 0;
  });
}
