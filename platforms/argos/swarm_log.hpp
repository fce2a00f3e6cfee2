// Loop functions that keep an experiment's log in the suite's format: who hears whom, what each
// robot has written in each step, where those are that move, and the end. Called by ARGoS on its
// main thread, when no robot is being stepped. Label in experiment files: swarmtalk_log.
#pragma once

#include <argos3/core/simulator/entity/embodied_entity.h>
#include <argos3/core/simulator/loop_functions.h>

#include <cstdint>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include "platforms/argos/controller.hpp"
#include "platforms/argos/line_of_sight.hpp"

namespace swarmtalk::platforms::in_argos {

class SwarmLog : public argos::CLoopFunctions {
 public:
  /// @param node  its <params> has `log`, the file to write ("" or none: no log), and `scenario`,
  ///              a file whose first line becomes the log's
  void Init(argos::TConfigurationNode& node) override;
  void Reset() override;
  void PostStep() override;
  bool IsExperimentFinished() override;
  void PostExperiment() override;
  void Destroy() override;

 private:
  struct Site {
    Controller* controller;
    argos::CEmbodiedEntity* body;
    Standing standing;  // where it was when it was last written down
    double theta_rad;
    uint64_t contacts = 0;
  };

  void find_robots();
  void open_log();
  void write_links();
  void write_pose(Site& site);
  /// Writes how it ended, and closes it. @return whether all of it could be written
  bool close_log();
  double seconds() const;

  std::vector<Site> sites_;  // by index
  std::string path_;
  std::string header_;
  std::FILE* log_ = nullptr;
  std::clock_t begun_ = 0;
};

}  // namespace swarmtalk::platforms::in_argos
