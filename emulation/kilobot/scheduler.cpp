#include "emulation/kilobot/scheduler.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

namespace swarmtalk::emulator {
namespace {

constexpr std::uint64_t kWaitStepNs = 1'000'000;  // shorter waits are not worth a system call

}  // namespace

Scheduler::WallClock monotonic_clock() {
  using Clock = std::chrono::steady_clock;
  const auto now_ns = [] {
    return static_cast<std::uint64_t>(
        std::chrono::nanoseconds(Clock::now().time_since_epoch()).count());
  };
  const auto sleep_until_ns = [](std::uint64_t time_ns) {
    std::this_thread::sleep_until(
        Clock::time_point(std::chrono::nanoseconds(static_cast<std::int64_t>(time_ns))));
  };
  return {now_ns, sleep_until_ns};
}

void Scheduler::pace(double factor, WallClock clock) {
  factor_ = factor;
  wall_clock_ = std::move(clock);
  wall_start_ns_ = wall_clock_.now_ns();
  paced_from_ns_ = now_ns_;
}

std::uint64_t Scheduler::wall_ns(std::uint64_t emulated_ns) const {
  const auto paced_ns = static_cast<double>(emulated_ns - paced_from_ns_);
  return wall_start_ns_ + static_cast<std::uint64_t>(paced_ns / factor_);
}

void Scheduler::wait_for_wall_clock() {
  const std::uint64_t due_ns = wall_ns(now_ns_);
  if (due_ns > wall_clock_.now_ns() + kWaitStepNs) wall_clock_.sleep_until_ns(due_ns);
}

void Scheduler::run_until(std::uint64_t time_ns) {
  std::uint64_t next_wait_ns = now_ns_;
  while (now_ns_ < time_ns && !is_stopping_) {
    for (Periodic& periodic : tasks_)
      while (periodic.next_ns <= now_ns_) {
        periodic.task(periodic.next_ns);
        periodic.next_ns += periodic.period_ns;
      }
    now_ns_ = std::min(now_ns_ + quantum_ns_, time_ns);
    for (Steppable* node : nodes_) node->run_until(now_ns_);
    if (factor_ > 0 && now_ns_ >= next_wait_ns) {
      wait_for_wall_clock();
      next_wait_ns = now_ns_ + kWaitStepNs;
    }
  }
}

}  // namespace swarmtalk::emulator
