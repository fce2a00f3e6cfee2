#include "platforms/argos/controller.hpp"

#include <argos3/core/simulator/simulator.h>

#include <cstring>

#include "platforms/argos/experiment_file.hpp"

namespace swarmtalk::platforms::in_argos {
namespace {

/// How many controllers there are; the programs' modules share this library, so they share it.
uint32_t next_index = 0;

void read(argos::TConfigurationNode& params, Settings& settings) {
  argos::TConfigurationAttributeIterator each;
  for (each = each.begin(&params); each != each.end(); ++each) {
    const std::string complaint = take_attribute(settings, each->Name(), each->Value());
    if (!complaint.empty()) THROW_ARGOSEXCEPTION(complaint);
  }
}

}  // namespace

void Controller::Init(argos::TConfigurationNode& params) {
  check_experiment_file();
  settings_.seed = argos::CSimulator::GetInstance().GetRandomSeed();
  settings_.index = next_index++;
  read(params, settings_);
  connect();
  robot_ = make_(settings_);
}

void Controller::Reset() {
  step_ = 0;
  has_shown_ = false;
  robot_ = make_(settings_);
}

bool Controller::has_new_colour() {
  const Colour colour = robot_->colour();
  if (has_shown_ && std::memcmp(&colour, &shown_, sizeof colour) == 0) return false;
  has_shown_ = true;
  shown_ = colour;
  return true;
}

}  // namespace swarmtalk::platforms::in_argos
