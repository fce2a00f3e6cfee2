// One simulated run as the runner gives it: JSON, every length in mm, every time in s or us as its
// key says. The same object is the first line of the run's log, so a log replays its run.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/world_config.hpp"
#include "suite/programs/news.hpp"

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
  NewsSettings news;    // [message]
  nlohmann::json text;  // as read
};

/// @throws std::exception with one line that says what is wrong
Scenario read_scenario(const std::string& path);

/// Tells a program that has been made, and not set up, what the scenario says of it.
template <class Program>
void configure(Program& program, const Scenario& scenario) {
  if constexpr (requires { program.set(scenario.news); }) program.set(scenario.news);
}

/// @throws std::runtime_error when [message] does not fit this profile
template <class Profile>
void check_message(const Scenario& scenario) {
  using W = core::Wire<Profile>;
  if (scenario.news.ttl > W::kTtlMax) {
    throw std::runtime_error("message.ttl is " + std::to_string(scenario.news.ttl) +
                             ": this profile's field holds at most " + std::to_string(W::kTtlMax));
  }
  if (scenario.news.bytes > W::kMessageBytes) {
    throw std::runtime_error("message.bytes is " + std::to_string(scenario.news.bytes) +
                             ": this profile's messages have at most " +
                             std::to_string(W::kMessageBytes));
  }
}

/// Puts the scenario's [radio], [body], [clock] and faults over the platform's own.
/// @throws std::exception that names a key nobody knows
void apply(const Scenario& scenario, sim::RadioConfig& radio, sim::BodyConfig& body,
           sim::ClockConfig& clock, std::vector<sim::Fault>& faults);

}  // namespace swarmtalk::suite
