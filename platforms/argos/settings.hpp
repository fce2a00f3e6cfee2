// What an experiment file says of one robot and of the whole, as plain values, and what is wrong
// with it. Read by the glue, on ARGoS's main thread, before the first step.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace swarmtalk::platforms::in_argos {

/// One robot; by default what <params> leaves out.
struct Settings {
  uint64_t seed = 1;   // the experiment's random_seed
  uint32_t index = 0;  // from 0; its node id
  int role = 0;        // the program's own: its enum's number
  bool has_random_id = false;
  uint32_t drift_ppm = 0;           // its clock is off by up to this
  uint32_t power_on_spread_us = 0;  // it starts within this
};

/// Takes an attribute of a controller's <params>.
/// @return what is wrong with it, in one line; empty: nothing
std::string take_attribute(Settings& settings, const std::string& name, const std::string& value);

/// The experiment, as far as it can be wrong in ways that ARGoS does not explain. Lengths in m.
struct Experiment {
  uint32_t steps_per_second = 0;
  double arena_min[2] = {0, 0};
  double arena_max[2] = {0, 0};
  struct Place {
    std::string name;
    double x = 0;
    double y = 0;
    double range = 0;          // of its radio; 0: not said
    bool is_kilobots = false;  // the radio: it reaches some 0.1 m
  };
  std::vector<Place> robots;
};

/// What is wrong with an experiment and what to do, in one line; empty if it can run.
std::string complaint_about(const Experiment& experiment);

}  // namespace swarmtalk::platforms::in_argos
