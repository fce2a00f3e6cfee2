#include "tests/support/turned_clock.hpp"

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "loop/chance.hpp"
#include "loop/clock.hpp"
#include "loop/loop.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::loop {

struct Timer::Wait {
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
};

constexpr Time kBegin{std::chrono::hours(1)};  // no time is before the clock began
Time present = kBegin;                         // NOLINT: the one clock of the program
std::chrono::nanoseconds wall_offset{0};       // NOLINT: of all steps
std::chrono::nanoseconds offset_before{0};     // NOLINT: before those of the instant `stepped_at`
Time stepped_at{};                             // NOLINT
std::vector<Due> waits;                        // NOLINT: by time, and in the order of their asking
std::mt19937 chance(1);                        // NOLINT: the one source of the program

void wait_until(Time time, Call call) {
  const auto is_later = [](Time at, const Due& due) { return at < due.time; };
  waits.insert(std::upper_bound(waits.begin(), waits.end(), time, is_later),
               {time, std::move(call)});
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
  while (!waits.empty() && waits.front().time <= end) {
    const Due due = std::move(waits.front());
    waits.erase(waits.begin());
    const Time before = std::exchange(present, std::max(present, due.time));
    if (due.call()) return true;
    present = before;
  }
  return false;
}

}  // namespace

void begin(std::uint64_t seed) {
  waits.clear();
  present = kBegin;
  wall_offset = offset_before = std::chrono::nanoseconds(0);
  stepped_at = Time{};
  chance.seed(static_cast<std::mt19937::result_type>(seed));
}

void step_wall_clock(std::chrono::nanoseconds step) {
  if (stepped_at != present) offset_before = wall_offset;
  stepped_at = present;
  wall_offset += step;
}

std::chrono::system_clock::time_point wall_before_steps() {
  return loop::wall_now() -
         (stepped_at == present ? wall_offset - offset_before : std::chrono::nanoseconds(0));
}

void pass(boost::asio::io_context& io, std::chrono::nanoseconds duration) {
  const Time end = present + duration;
  do {
    run_ready(io);
  } while (turn_to_next(end));
  present = end;
}

void pass(std::chrono::nanoseconds duration) {
  boost::asio::io_context io;
  pass(io, duration);
}

bool pass_until(boost::asio::io_context& io, const std::function<bool()>& is_done,
                std::chrono::nanoseconds limit) {
  const Time end = present + limit;
  for (;;) {
    const bool has_run = run_ready(io);
    if (is_done()) return true;
    // is_done() itself may make something ready, as by reading from a full socket.
    if (!has_run && !turn_to_next(end)) return false;
  }
}

}  // namespace swarmtalk::test

namespace swarmtalk::loop {

std::chrono::steady_clock::time_point now() {
  return test::present;
}

std::chrono::system_clock::time_point wall_now() {
  constexpr std::chrono::seconds kFirstOf2026{1'767'225'600};
  return std::chrono::system_clock::time_point(kFirstOf2026 + (test::present - test::kBegin) +
                                               test::wall_offset);
}

std::uint32_t random_bits() {
  return static_cast<std::uint32_t>(test::chance());
}

Timer::Timer(boost::asio::io_context&, std::function<void()> on_time)
    : wait_(std::make_shared<Wait>()) {
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
  test::wait_until(time, [waiting = std::weak_ptr<Wait>(next)] {
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
