// LinkState: whether a link is up, and why not. Changes are logged, at most once in an interval, so
// that an interface that flaps does not fill the log.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "loop/timer.hpp"

namespace swarmtalk::drivers {

class LinkState {
 public:
  /// @param line  what to log: the state, and how often it changed since the last line if that is
  ///              more than once
  using Log = std::function<void(bool is_up, const std::string& line)>;

  LinkState(boost::asio::io_context& io, Log log,
            std::chrono::milliseconds interval = std::chrono::seconds(1));

  bool is_up() const { return is_up_; }
  const std::string& text() const { return text_; }

  /// @return whether the link went up or down by it
  bool set(bool is_up, const std::string& text);

 private:
  void log();

  Log log_;
  std::chrono::milliseconds interval_;
  loop::Timer timer_;  // until the next change may be logged
  std::uint64_t unlogged_changes_ = 0;
  bool is_up_ = false;
  std::string text_ = "not started";
};

}  // namespace swarmtalk::drivers
