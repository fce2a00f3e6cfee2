// What `radar` shows: this robot in the middle with its heading up, around it who is heard, as far
// and in the direction that was sensed, and how fresh that is. Pure functions.
#pragma once

#include <string>
#include <vector>

#include <swarmtalk/client.hpp>

namespace swarmtalk::cli {

struct RadarLook {
  std::size_t width = 80;
  std::size_t height = 24;
  double range_m = 0;  // 0: as far as the farthest
};

/// The range of the outer ring: the wish, or 1, 2 or 5 times a power of ten beyond the farthest.
double radar_range_m(const std::vector<Neighbour>& neighbours, double wish_m);

std::vector<std::string> radar_lines(const std::vector<Neighbour>& neighbours,
                                     const RadarLook& look);

}  // namespace swarmtalk::cli
