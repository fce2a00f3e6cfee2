// CopySchedule: when the next copy of each important message is due. A few wait at a time. It reads
// no clock.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace swarmtalk::daemon {

class CopySchedule {
 public:
  using Time = std::chrono::steady_clock::time_point;

  struct Due {
    Time at;
    std::uint16_t channel;
    std::size_t station;
    std::uint64_t publication;  // its serial
  };

  /// Called with the time of the next copy, whenever that changes to an earlier one. Must be cheap.
  void set_hook(std::function<void(Time)> hook) { hook_ = std::move(hook); }

  void add(const Due& copy);

  /// Those that are due, taken out.
  std::vector<Due> take(Time now);

  /// Tells the hook of the next again, if there is one.
  void tell_next() const;

 private:
  std::vector<Due> waiting_;  // in no order
  std::function<void(Time)> hook_ = [](Time) {};
};

}  // namespace swarmtalk::daemon
