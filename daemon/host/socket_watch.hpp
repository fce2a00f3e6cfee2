// SocketWatch: notices that the file of the daemon's socket is gone while the daemon lives, which
// the socket itself never tells: nobody could connect any more, and everything would look well. The
// kernel reports it at once; where it gives no watch, the file is looked at from time to time.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <chrono>
#include <functional>
#include <string>

#include "loop/timer.hpp"

namespace swarmtalk::daemon {

class SocketWatch {
 public:
  /// @param path  of a socket that exists
  /// @param restore  called when it is gone. @return false: try again after `retry`
  SocketWatch(boost::asio::io_context& io, const std::string& path, std::function<bool()> restore,
              std::chrono::milliseconds retry = std::chrono::seconds(5));

 private:
  void watch_folder();
  void watch_by_clock(const char* remedy);
  void wait();
  void on_events();
  void check();

  std::string path_;
  std::string folder_;
  std::function<bool()> restore_;
  std::chrono::milliseconds retry_;
  boost::asio::posix::stream_descriptor events_;
  loop::Timer timer_;
  bool is_told_ = false;  // that there is no watch
};

}  // namespace swarmtalk::daemon
