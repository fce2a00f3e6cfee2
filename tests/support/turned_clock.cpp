#include "tests/support/turned_clock.hpp"

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "loop/chance.hpp"
#include "loop/clock.hpp"
#include "loop/loop.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::loop {

struct Timer::Wait {
  const boost::asio::io_context* machine = nullptr;
  std::function<void()> on_time;
  Time time{};
  bool is_armed = false;
};

}  // namespace swarmtalk::loop

namespace swarmtalk::test {
namespace {

using Time = loop::Timer::Time;
using Call = std::function<bool()>;  // @return false: it was cancelled

struct Due {
  Time time;
  Call call;
  const boost::asio::io_context* machine;
};

constexpr Time kBegin{std::chrono::hours(1)};  // no time is before the clock began
Time present = kBegin;                         // NOLINT: the one clock of the program
std::chrono::nanoseconds wall_offset{0};       // NOLINT: of all steps of all machines
std::vector<Due> waits;                        // NOLINT: by time, and in the order of their asking
std::mt19937 chance(1);                        // NOLINT: the one source of the program

using Machine = const boost::asio::io_context*;
std::map<Machine, std::chrono::nanoseconds> wall_offsets;  // NOLINT: of one machine's steps
std::set<Machine> held;                                    // NOLINT: whose timers wait
Machine entered = nullptr;                                 // NOLINT: whose code runs
std::map<Machine, std::uint64_t> calls;                    // NOLINT: of timers

std::chrono::system_clock::time_point wall_of(Machine machine) {
  constexpr std::chrono::seconds kFirstOf2026{1'767'225'600};
  const auto own = wall_offsets.find(machine);
  return std::chrono::system_clock::time_point(
      kFirstOf2026 + (present - kBegin) + wall_offset +
      (own == wall_offsets.end() ? std::chrono::nanoseconds(0) : own->second));
}

void wait_until(Time time, Machine machine, Call call) {
  const auto is_later = [](Time at, const Due& due) { return at < due.time; };
  waits.insert(std::upper_bound(waits.begin(), waits.end(), time, is_later),
               {time, std::move(call), machine});
}

/// What is ready, without waiting. @return false: nothing was
bool run_ready(boost::asio::io_context& io) {
  std::size_t done = 0;
  std::size_t more = 0;
  do {
    io.restart();
    more = io.poll();
    done += more;
  } while (more > 0);
  return done > 0;
}

/// @return false: nobody waits for a time up to `end`
bool turn_to_next(Time end) {
  for (;;) {
    const auto next = std::find_if(waits.begin(), waits.end(), [](const Due& each) {
      return held.empty() || !held.contains(each.machine);
    });
    if (next == waits.end() || next->time > end) return false;
    const Due due = std::move(*next);
    waits.erase(next);
    entered = due.machine;
    const Time before = std::exchange(present, std::max(present, due.time));
    if (due.call()) {
      ++calls[due.machine];
      return true;
    }
    present = before;
  }
}

}  // namespace

void begin(std::uint64_t seed) {
  waits.clear();
  present = kBegin;
  wall_offset = std::chrono::nanoseconds(0);
  wall_offsets.clear();
  held.clear();
  entered = nullptr;
  calls.clear();
  chance.seed(static_cast<std::mt19937::result_type>(seed));
}

void enter(const boost::asio::io_context& io) {
  entered = &io;
}

const boost::asio::io_context* entered_machine() {
  return entered;
}

void step_wall_clock(std::chrono::nanoseconds step) {
  wall_offset += step;
}

void step_wall_clock(std::chrono::nanoseconds step, const boost::asio::io_context& io) {
  wall_offsets[&io] += step;
}

std::chrono::system_clock::time_point wall_now_of(const boost::asio::io_context& io) {
  return wall_of(&io);
}

std::uint64_t calls_of(const boost::asio::io_context& io) {
  return calls[&io];
}

void hold_timers(const boost::asio::io_context& io, bool are_held) {
  if (are_held) {
    held.insert(&io);
  } else {
    held.erase(&io);
  }
}

void pass(const std::function<bool()>& run_ready, std::chrono::nanoseconds duration) {
  const Time end = present + duration;
  do {
    run_ready();
  } while (turn_to_next(end));
  present = end;
}

void pass(boost::asio::io_context& io, std::chrono::nanoseconds duration) {
  pass([&io] { return run_ready(io); }, duration);
}

void pass(std::chrono::nanoseconds duration) {
  boost::asio::io_context io;
  pass(io, duration);
}

bool pass_until(const std::function<bool()>& run_ready, const std::function<bool()>& is_done,
                std::chrono::nanoseconds limit) {
  const Time end = present + limit;
  for (;;) {
    const bool has_run = run_ready();
    if (is_done()) return true;
    // is_done() itself may make something ready, as by reading from a full socket.
    if (!has_run && !turn_to_next(end)) return false;
  }
}

bool pass_until(boost::asio::io_context& io, const std::function<bool()>& is_done,
                std::chrono::nanoseconds limit) {
  return pass_until([&io] { return run_ready(io); }, is_done, limit);
}

}  // namespace swarmtalk::test

namespace swarmtalk::loop {

std::chrono::steady_clock::time_point now() {
  return test::present;
}

std::chrono::system_clock::time_point wall_now() {
  return test::wall_of(test::entered);
}

std::uint32_t random_bits() {
  return static_cast<std::uint32_t>(test::chance());
}

Timer::Timer(boost::asio::io_context& io, std::function<void()> on_time)
    : wait_(std::make_shared<Wait>()) {
  wait_->machine = &io;
  wait_->on_time = std::move(on_time);
}

Timer::~Timer() {
  cancel();
}

void Timer::at(Time time) {
  auto next = std::make_shared<Wait>(*wait_);
  wait_->is_armed = false;
  wait_ = next;
  next->time = time;
  next->is_armed = true;
  test::wait_until(time, next->machine, [waiting = std::weak_ptr<Wait>(next)] {
    const std::shared_ptr<Wait> wait = waiting.lock();
    if (wait == nullptr || !std::exchange(wait->is_armed, false)) return false;
    wait->on_time();
    return true;
  });
}

void Timer::after(Duration delay) {
  at(now() + delay);
}

void Timer::cancel() {
  wait_->is_armed = false;
}

bool Timer::is_armed() const {
  return wait_->is_armed;
}

}  // namespace swarmtalk::loop
