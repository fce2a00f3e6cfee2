// Air between senders and one receiver as rapidcheck draws it: loss, copies, reordering and
// interleaving. Every choice comes from rapidcheck, so a failure shrinks to the shortest story.
#pragma once

#include <rapidcheck.h>

#include <algorithm>
#include <map>
#include <memory>
#include <vector>

#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core::testing {

struct AirChoices {
  bool loses = false;
  bool copies = false;
  bool reorders = false;
};

/// A packet in the air, and the message it is of.
struct InAir {
  Bytes packet;
  size_t message;
};

/// The packets of all senders' messages in a drawn order (each sender's in its own order, unless
/// reordered), some lost, some twice.
inline std::vector<InAir> draw_air(const std::vector<std::vector<InAir>>& by_sender,
                                   const AirChoices& choices) {
  std::vector<InAir> air;
  std::vector<size_t> next(by_sender.size());
  for (;;) {
    std::vector<size_t> waiting;
    for (size_t i = 0; i < by_sender.size(); ++i) {
      if (next[i] < by_sender[i].size()) waiting.push_back(i);
    }
    if (waiting.empty()) break;
    const size_t sender = waiting[*rc::gen::inRange<size_t>(0, waiting.size())];
    const InAir& packet = by_sender[sender][next[sender]++];
    if (choices.loses && *rc::gen::inRange(0, 5) == 0) continue;
    air.push_back(packet);
    if (choices.copies && *rc::gen::inRange(0, 4) == 0) air.push_back(packet);
  }
  if (choices.reorders) {
    for (size_t i = 0; i + 1 < air.size(); ++i) {
      if (*rc::gen::inRange(0, 3) == 0) std::swap(air[i], air[i + 1]);
    }
  }
  return air;
}

}  // namespace swarmtalk::core::testing
