// Machine: where a daemon of a virtual swarm runs. It has an event loop and a wall clock of its
// own, and may stand still while others go on.
#pragma once

#include <boost/asio/io_context.hpp>
#include <string>

#include "loop/loop.hpp"

namespace swarmtalk::test {

class Machine {
 public:
  /// @param machines  an epoll instance, which has this machine in `data.ptr` when it has to run
  /// @param name      for its log lines
  Machine(int machines, std::string name);
  ~Machine();
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  boost::asio::io_context& io() { return io_; }
  /// Of the machine whose code runs.
  static std::string present_name();

  /// While it stands still nothing of it runs, and what comes to it waits.
  void set_running(bool is_running);
  bool is_running() const { return is_running_; }

  /// What has to be done without anything that comes.
  bool has_work() const { return is_running_ && loop_.has_work(); }
  /// Does a part of what is ready.
  void turn();

 private:
  int machines_;
  boost::asio::io_context io_;
  loop::Loop& loop_ = loop::Loop::of(io_);
  loop::Loop::Drive drive_{loop_};
  bool is_running_ = false;
};

}  // namespace swarmtalk::test
