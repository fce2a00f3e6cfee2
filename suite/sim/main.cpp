// swarmtalk-sim SCENARIO LOG: one simulated run. Called by swarmtalk-suite, which makes scenarios
// and reads logs. LOG "-" is none. Ctrl-C ends the run with what it has.
#include "suite/sim/run_scenario.hpp"

int main(int argc, char** argv) {
  using namespace swarmtalk;
  return suite::simulator_main<platforms::ComparedProfile>(
      argc, argv, [](auto* robot, const std::string& name, auto run) {
        return suite::with_program<std::remove_pointer_t<decltype(robot)>>(name, run);
      });
}
