// The commands that change a radio medium while it runs, and show it: link, move, partition, heal,
// jam, medium status.
#pragma once

#include <optional>
#include <string>

#include "lab/state.hpp"

namespace CLI {
class App;
}

namespace swarmtalk::lab {

class AirCommands {
 public:
  /// Adds them to the tool's command line. This object outlives the app's parsing.
  explicit AirCommands(CLI::App& app);
  AirCommands(const AirCommands&) = delete;
  AirCommands& operator=(const AirCommands&) = delete;

  /// One of them was on the command line.
  bool is_chosen() const;

  /// Carries it out. Throws std::runtime_error with one line when it cannot.
  /// @return exit code
  int run(const State& state) const;

 private:
  int set_link(const State& state) const;
  int move(const State& state) const;
  int partition(const State& state) const;
  int jam(const State& state) const;

  CLI::App* link_ = nullptr;
  CLI::App* move_ = nullptr;
  CLI::App* partition_ = nullptr;
  CLI::App* heal_ = nullptr;
  CLI::App* jam_ = nullptr;
  CLI::App* medium_ = nullptr;

  int from_ = 0;
  int to_ = 0;
  std::optional<double> loss_;
  bool is_reset_ = false;
  bool is_one_way_ = false;
  int robot_ = 0;
  double x_m_ = 0;
  double y_m_ = 0;
  double speed_mps_ = 0;
  std::string robots_;
  std::optional<double> line_x_m_;
  std::optional<double> jam_x_m_;
  std::optional<double> jam_y_m_;
  std::optional<double> radius_m_;
  bool is_off_ = false;
  bool as_json_ = false;
};

}  // namespace swarmtalk::lab
