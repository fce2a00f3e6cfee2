// Emulation: a scenario brought to life: nodes, medium, lamp, log and scheduler, joined. One thread
// calls everything. Tests and the program build it alike.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "emulation/kilobot/event_log.hpp"
#include "emulation/kilobot/lamp.hpp"
#include "emulation/kilobot/node.hpp"
#include "emulation/kilobot/scenario.hpp"
#include "emulation/kilobot/scheduler.hpp"

namespace swarmtalk::emulator {

class Emulation {
 public:
  /// Loads images, opens terminals and the log. Powers nothing on yet.
  /// @param log_to  stream for the log instead of the scenario's file; must outlive this object
  /// @throws std::runtime_error
  explicit Emulation(Scenario scenario, std::ostream* log_to = nullptr);

  /// Runs to a time since the start; may be called again with a later one.
  void run_until(double seconds);
  /// Runs the scenario's time and writes each node's figures to the log.
  void run();
  /// Makes run() return soon (from a signal's flag or a periodic task).
  void stop() { scheduler_.stop(); }

  Scheduler& scheduler() { return scheduler_; }
  const std::vector<std::unique_ptr<Node>>& nodes() const { return nodes_; }
  const Node& node(const std::string& name) const;
  /// Variables to watch that no image has: misspelt, or of a program that is yet to be loaded.
  std::vector<std::string> unknown_variables() const;
  const Scenario& scenario() const { return scenario_; }
  double emulated_seconds() const { return static_cast<double>(scheduler_.now_ns()) * 1e-9; }

 private:
  std::shared_ptr<const Image> load(const NodeSpec& spec);
  void add_node(const NodeSpec& spec, const OhcSpec* ohc);
  void add_tasks();

  Scenario scenario_;
  EventLog log_;
  Medium medium_;
  Scheduler scheduler_;
  std::map<std::pair<std::string, std::string>, std::shared_ptr<const Image>> images_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::vector<std::string> station_names_;
  std::unique_ptr<Lamp> lamp_;
};

}  // namespace swarmtalk::emulator
