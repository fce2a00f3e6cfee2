// Timer: one call, at a time that each wait names. A wait is forgotten with the timer, by cancel()
// and by the next wait: after these no call comes for it. On the loop's thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <memory>

namespace swarmtalk::loop {

class Timer {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  /// @param on_time  may end this timer, or begin the next wait
  Timer(boost::asio::io_context& io, std::function<void()> on_time);
  ~Timer();
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

  /// In place of what it waits for. A time that is over: with the next turn.
  void at(Time time);
  void after(Duration delay);
  void cancel();
  bool is_armed() const;

 private:
  struct Wait;
  std::shared_ptr<Wait> wait_;
};

}  // namespace swarmtalk::loop
