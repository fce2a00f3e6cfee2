// The cells of the one-hop tables, as parameters of tests.
#pragma once

#include <ostream>

#include "tests/swarm/one_hop.hpp"

namespace swarmtalk::core::testing {

struct Cell {
  double range;
  double loss;
  uint8_t packets;
};

inline std::ostream& operator<<(std::ostream& out, const Cell& cell) {
  return out << "range " << cell.range << ", loss " << cell.loss << ", "
             << static_cast<int>(cell.packets) << " packets";
}

inline OneHopConfig one_hop(const Cell& cell) {
  OneHopConfig config;
  config.range = cell.range;
  config.loss = cell.loss;
  config.packets = cell.packets;
  config.seconds = 150;
  return config;
}

}  // namespace swarmtalk::core::testing
