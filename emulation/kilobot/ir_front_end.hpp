// IrFrontEnd: the analog input of one robot. Holds the light edges that are on their way to it,
// adds up the light of all senders that shine at once (so that collisions happen as they do in
// air), and says what the comparator and the two amplifiers show. Knows nothing of processors.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>

#include "emulation/kilobot/signal_model.hpp"

namespace swarmtalk::emulator {

struct SignalEdge {
  std::uint64_t cycle = 0;  // of the receiving robot's clock
  SignalStrength strength;  // what this sender's light adds
  bool is_rising = false;
};

class IrFrontEnd {
 public:
  static constexpr std::uint64_t kNever = UINT64_MAX;

  /// Edges may come in any order; those of one cycle keep the order in which they came.
  void push(const SignalEdge& edge) {
    const auto later = [](const SignalEdge& a, const SignalEdge& b) { return a.cycle < b.cycle; };
    edges_.insert(std::upper_bound(edges_.begin(), edges_.end(), edge, later), edge);
  }

  std::uint64_t next_cycle() const { return edges_.empty() ? kNever : edges_.front().cycle; }

  /// Takes the edges that are due, but no more than one change of the comparator: the robot must
  /// get the chance to see each of them.
  /// @return true if the comparator has changed
  bool apply_until(std::uint64_t cycle) {
    const bool was_lit = is_lit();
    while (!edges_.empty() && edges_.front().cycle <= cycle && is_lit() == was_lit) {
      const SignalEdge edge = edges_.front();
      edges_.pop_front();
      const int sign = edge.is_rising ? 1 : -1;
      senders_ += sign;
      high_sum_ += sign * edge.strength.high_gain;
      low_sum_ += sign * edge.strength.low_gain;
      if (edge.is_rising) peak_ = total();
    }
    return is_lit() != was_lit;
  }

  bool is_lit() const { return senders_ > 0; }

  /// The amplifiers hold the light of the last rising edge, long enough to be converted.
  SignalStrength peak() const { return peak_; }

 private:
  SignalStrength total() const {
    return {static_cast<std::uint16_t>(std::min(high_sum_, kConverterMax)),
            static_cast<std::uint16_t>(std::min(low_sum_, kConverterMax))};
  }

  std::deque<SignalEdge> edges_;
  int senders_ = 0;
  int high_sum_ = 0;
  int low_sum_ = 0;
  SignalStrength peak_;
};

}  // namespace swarmtalk::emulator
