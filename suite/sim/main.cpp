// swarmtalk-sim SCENARIO LOG: one simulated run. Called by swarmtalk-suite, which makes scenarios
// and reads logs. LOG "-" is none. Ctrl-C ends the run with what it has.
// swarmtalk-sim --join TARGET [--first-id N] SCENARIO LOG: its robots on the air of real ones, in
// real time (docs/ghosts.md). Prints what became of their frames as JSON at the end.
#include <cstring>

#include "suite/sim/ghost_run.hpp"
#include "suite/sim/run_scenario.hpp"

int main(int argc, char** argv) {
  using namespace swarmtalk;
  const auto with_program = [](auto* robot, const std::string& name, auto run) {
    return suite::with_program<std::remove_pointer_t<decltype(robot)>>(name, run);
  };
  if (argc > 1 && std::strcmp(argv[1], "--join") == 0) {
    return suite::ghosts_main<platforms::ComparedProfile>(argc, argv, with_program);
  }
  return suite::simulator_main<platforms::ComparedProfile>(argc, argv, with_program);
}
