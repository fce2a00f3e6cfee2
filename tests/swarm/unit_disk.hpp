// Who hears whom on a plane: everybody within the range, nobody beyond it.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

namespace swarmtalk::core::testing {

class UnitDisk {
 public:
  /// @param range  in the unit of the positions
  explicit UnitDisk(double range) : range_(range) {}
  /// `side` * `side` robots on a grid of step 1, row by row.
  UnitDisk(uint32_t side, double range) : range_(range) {
    for (uint32_t i = 0; i < side * side; ++i) add(i % side, i / side);
  }

  void add(double x, double y) { robots_.push_back({x, y, {}}); }
  /// Finds each robot's neighbours. Once, after the last add().
  void connect() {
    for (uint32_t i = 0; i < size(); ++i) {
      for (uint32_t j = 0; j < size(); ++j) {
        if (hears(i, j)) robots_[i].neighbours.push_back(j);
      }
    }
  }

  uint32_t size() const { return static_cast<uint32_t>(robots_.size()); }
  double distance(uint32_t i, uint32_t j) const {
    return std::hypot(robots_[i].x - robots_[j].x, robots_[i].y - robots_[j].y);
  }
  bool hears(uint32_t i, uint32_t j) const { return i != j && distance(i, j) <= range_; }
  const std::vector<uint32_t>& neighbours(uint32_t i) const { return robots_[i].neighbours; }
  double mean_neighbours() const {
    double sum = 0;
    for (const Robot& robot : robots_) sum += static_cast<double>(robot.neighbours.size());
    return sum / size();
  }

 private:
  struct Robot {
    double x;
    double y;
    std::vector<uint32_t> neighbours;
  };
  double range_;
  std::vector<Robot> robots_;
};

}  // namespace swarmtalk::core::testing
