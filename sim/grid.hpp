// Who is near: robots in square cells as wide as a question reaches, so that an answer looks at
// nine cells, however many robots there are. Owned by the world; single-threaded.
#pragma once

#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace swarmtalk::sim {

class Grid {
 public:
  /// @param cell_mm  the farthest that for_near() looks
  explicit Grid(double cell_mm) : cell_mm_(cell_mm) {}

  void add(uint32_t robot, double x_mm, double y_mm) {
    const uint64_t key = key_of(cell(x_mm), cell(y_mm));
    if (where_.size() <= robot) where_.resize(robot + 1);
    where_[robot] = key;
    cells_[key].push_back(robot);
  }

  void move(uint32_t robot, double x_mm, double y_mm) {
    if (where_[robot] == key_of(cell(x_mm), cell(y_mm))) return;
    std::vector<uint32_t>& old = cells_[where_[robot]];
    for (uint32_t& entry : old) {
      if (entry != robot) continue;
      entry = old.back();
      old.pop_back();
      break;
    }
    add(robot, x_mm, y_mm);
  }

  /// Calls visit(robot) for all robots in the nine cells around a place, in no useful order.
  template <class Visit>
  void for_near(double x_mm, double y_mm, Visit visit) const {
    const int32_t column = cell(x_mm);
    const int32_t row = cell(y_mm);
    for (int32_t r = row - 1; r <= row + 1; ++r) {
      for (int32_t c = column - 1; c <= column + 1; ++c) {
        const auto found = cells_.find(key_of(c, r));
        if (found == cells_.end()) continue;
        for (const uint32_t robot : found->second) visit(robot);
      }
    }
  }

 private:
  int32_t cell(double mm) const { return static_cast<int32_t>(std::floor(mm / cell_mm_)); }
  static uint64_t key_of(int32_t column, int32_t row) {
    return uint64_t{static_cast<uint32_t>(column)} << 32 | static_cast<uint32_t>(row);
  }

  double cell_mm_;
  std::unordered_map<uint64_t, std::vector<uint32_t>> cells_;
  std::vector<uint64_t> where_;  // by robot
};

}  // namespace swarmtalk::sim
