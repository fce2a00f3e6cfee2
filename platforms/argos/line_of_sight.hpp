// Who hears whom in ARGoS, from where robots stand: within range, and for foot-bots with no third
// body between the two. For the log's `links`, so that counts are judged over the graph there is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace swarmtalk::platforms::in_argos {

struct Standing {
  double x_mm = 0;
  double y_mm = 0;
  double range_mm = 0;  // of its own radio
};

/// Whether the straight line from `a` to `b` misses the disc of `diameter_mm` around `c`.
inline bool is_free_of(const Standing& a, const Standing& b, const Standing& c,
                       double diameter_mm) {
  const double dx = b.x_mm - a.x_mm;
  const double dy = b.y_mm - a.y_mm;
  const double length2 = dx * dx + dy * dy;
  double along = length2 > 0 ? ((c.x_mm - a.x_mm) * dx + (c.y_mm - a.y_mm) * dy) / length2 : 0;
  along = along < 0 ? 0 : along > 1 ? 1 : along;
  const double off_x = a.x_mm + along * dx - c.x_mm;
  const double off_y = a.y_mm + along * dy - c.y_mm;
  return off_x * off_x + off_y * off_y > diameter_mm * diameter_mm / 4;
}

/// Robots that hear `robots[sender]`.
/// @param diameter_mm  of the bodies that stand in the way; 0: none does
inline std::vector<uint32_t> listeners(const std::vector<Standing>& robots, size_t sender,
                                       double diameter_mm) {
  const Standing& from = robots[sender];
  std::vector<uint32_t> found;
  for (size_t i = 0; i < robots.size(); ++i) {
    const double dx = robots[i].x_mm - from.x_mm;
    const double dy = robots[i].y_mm - from.y_mm;
    if (i == sender || dx * dx + dy * dy >= from.range_mm * from.range_mm) continue;
    bool is_free = true;
    for (size_t k = 0; diameter_mm > 0 && is_free && k < robots.size(); ++k) {
      is_free = k == sender || k == i || is_free_of(from, robots[i], robots[k], diameter_mm);
    }
    if (is_free) found.push_back(static_cast<uint32_t>(i));
  }
  return found;
}

}  // namespace swarmtalk::platforms::in_argos
