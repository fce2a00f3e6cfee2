#include "loop/timer.hpp"

#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <utility>

#include "loop/clock.hpp"

namespace swarmtalk::loop {

struct Timer::Wait {
  Wait(boost::asio::io_context& io, std::function<void()> function)
      : timer(io), on_time(std::move(function)) {}

  boost::asio::steady_timer timer;
  std::function<void()> on_time;
  std::uint64_t number = 0;  // Asio may have queued the handler of a wait that is cancelled then
  bool is_armed = false;
};

Timer::Timer(boost::asio::io_context& io, std::function<void()> on_time)
    : wait_(std::make_shared<Wait>(io, std::move(on_time))) {}

Timer::~Timer() {
  cancel();
}

void Timer::at(Time time) {
  wait_->is_armed = true;
  wait_->timer.expires_at(time);
  wait_->timer.async_wait([waiting = std::weak_ptr<Wait>(wait_),
                           number = ++wait_->number](const boost::system::error_code& error) {
    const std::shared_ptr<Wait> wait = waiting.lock();  // on_time() may end the timer
    if (error || wait == nullptr || wait->number != number) return;
    wait->is_armed = false;
    wait->on_time();
  });
}

void Timer::after(Duration delay) {
  at(now() + delay);
}

void Timer::cancel() {
  if (!std::exchange(wait_->is_armed, false)) return;
  ++wait_->number;
  wait_->timer.cancel();
}

bool Timer::is_armed() const {
  return wait_->is_armed;
}

}  // namespace swarmtalk::loop
