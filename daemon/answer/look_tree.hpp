// LookTree: who looks, and over whom our reports get there. Each root's wish travels with the
// reports themselves: who hears one from nearer to the root takes its sender for parent. So nothing
// is flooded, and where nobody looks nothing is sent. Bounded; reads no clock.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "report/report.hpp"

namespace swarmtalk::daemon {

class LookTree {
 public:
  using Time = std::chrono::steady_clock::time_point;

  static constexpr std::uint8_t kMostDepth = 32;
  static constexpr std::uint8_t kMostSeconds = 120;

  /// Somebody on this robot looks.
  void look(std::uint16_t self, const report::Look& look, Time now);

  /// Another robot tells in its report of those who look.
  void heard(std::uint16_t self, std::uint16_t sender, const report::Report& report, Time now);

  bool is_looked_at(Time now);

  /// Whether the transmitter of this report relies on us to pass its records on.
  bool is_child(std::uint16_t self, const report::Report& report) const;

  /// As our next report tells it. A root of our own counts up.
  std::vector<report::Root> roots(std::uint16_t self, Time now);
  std::vector<std::uint16_t> wanted(Time now);
  bool is_wanted(std::uint16_t self, Time now);

 private:
  struct Entry {
    std::uint16_t node = 0, number = 0, parent = 0;
    std::uint8_t depth = 0;
    Time until{};
    std::vector<std::uint16_t> wanted;
  };

  Entry* entry_for(std::uint16_t root, Time now);
  void forget_old(Time now);

  std::vector<Entry> entries_;  // at most report::kMostRoots
};

}  // namespace swarmtalk::daemon
