// ServiceManager: the daemon's side of sd_notify(3): ready, reloading, stopping, one line of
// status, and the watchdog, which is fed from the event loop, so that it bites when the loop hangs.
// Does nothing when systemd did not start us.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <string>

#include "loop/timer.hpp"

namespace swarmtalk::daemon {

class ServiceManager {
 public:
  /// @param status  makes the line that `systemctl status` shows
  ServiceManager(boost::asio::io_context& io, std::function<std::string()> status);

  void ready();
  void reloading();  // ready() ends it
  void stopping();

 private:
  void tick();

  std::function<std::string()> status_;
  loop::Timer timer_;
  std::chrono::microseconds period_{0};  // 0: nobody listens
  std::string told_;
};

}  // namespace swarmtalk::daemon
