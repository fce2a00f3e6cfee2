// One simulated run as the runner gives it: JSON, every length in mm, every time in s or us as its
// key says. The same object is the first line of the run's log, so a log replays its run.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sim/world_config.hpp"

namespace swarmtalk::suite {

struct Placement {
  double x_mm = 0;
  double y_mm = 0;
  double theta_rad = 0;
  int role = 0;  // the program's own: its enum's number
};

struct Scenario {
  std::string program;
  std::string platform;  // sim-kilobot or sim-coachbot
  uint64_t seed = 1;
  double seconds = 10;
  bool has_random_ids = false;  // else ids are the robots' numbers, as a swarm with uids has them
  std::vector<Placement> robots;
  nlohmann::json text;  // as read
};

/// @throws std::exception with one line that says what is wrong
Scenario read_scenario(const std::string& path);

/// Puts the scenario's [radio], [body], [clock] and faults over the platform's own.
/// @throws std::exception that names a key nobody knows
void apply(const Scenario& scenario, sim::RadioConfig& radio, sim::BodyConfig& body,
           sim::ClockConfig& clock, std::vector<sim::Fault>& faults);

}  // namespace swarmtalk::suite
