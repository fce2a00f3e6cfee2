// Scheduler: shared time. Runs all nodes in lockstep, one quantum after the other and always in the
// same order, so that a run depends on nothing but the scenario; calls periodic tasks between two
// quanta; and, if asked, waits for the wall clock.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace swarmtalk::emulator {

class Steppable {
 public:
  virtual ~Steppable() = default;
  /// Executes everything before `time_ns`.
  virtual void run_until(std::uint64_t time_ns) = 0;
};

class Scheduler {
 public:
  using Task = std::function<void(std::uint64_t time_ns)>;
  /// Returns nanoseconds of a clock that never goes back; sleeping until one of its times.
  struct WallClock {
    std::function<std::uint64_t()> now_ns;
    std::function<void(std::uint64_t)> sleep_until_ns;
  };

  explicit Scheduler(std::uint64_t quantum_ns) : quantum_ns_(quantum_ns) {}

  /// Nodes run in the order in which they are added; they must outlive the scheduler.
  void add(Steppable& node) { nodes_.push_back(&node); }

  /// Calls a task each period, first at time 0; before the nodes run through that quantum.
  void every(std::uint64_t period_ns, Task task) { tasks_.push_back({period_ns, 0, task}); }

  /// From now on emulated time runs at most `factor` times as fast as the wall clock. If the
  /// machine is too slow, the emulation falls behind and catches up when it can.
  void pace(double factor, WallClock clock);

  void run_until(std::uint64_t time_ns);
  void stop() { is_stopping_ = true; }

  /// @return the wall-clock time that belongs to an emulated time. Only with pacing.
  std::uint64_t wall_ns(std::uint64_t emulated_ns) const;

  std::uint64_t now_ns() const { return now_ns_; }
  std::uint64_t quantum_ns() const { return quantum_ns_; }

 private:
  struct Periodic {
    std::uint64_t period_ns;
    std::uint64_t next_ns;
    Task task;
  };
  void wait_for_wall_clock();

  std::uint64_t quantum_ns_;
  std::uint64_t now_ns_ = 0;
  bool is_stopping_ = false;
  std::vector<Steppable*> nodes_;
  std::vector<Periodic> tasks_;
  double factor_ = 0;  // 0: do not wait
  WallClock wall_clock_;
  std::uint64_t wall_start_ns_ = 0;
  std::uint64_t paced_from_ns_ = 0;
};

/// CLOCK_MONOTONIC.
Scheduler::WallClock monotonic_clock();

}  // namespace swarmtalk::emulator
