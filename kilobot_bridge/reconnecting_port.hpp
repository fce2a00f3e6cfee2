// ReconnectingPort: a serial device that may be unplugged and plugged in again: it is reopened
// with growing pauses, and what happens is told to its user. It opens the one path it was given and
// no other. Runs on the io_context's thread.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <span>
#include <string>
#include <vector>

#include "kilobot_bridge/serial_device.hpp"
#include "loop/loop.hpp"
#include "loop/timer.hpp"
#include "serial/holders.hpp"

namespace swarmtalk::kilobot_bridge {

class ReconnectingPort;

class PortUser {
 public:
  virtual ~PortUser() = default;
  virtual void on_port_open(ReconnectingPort& port) = 0;
  virtual void on_port_bytes(ReconnectingPort& port, std::span<const std::uint8_t> bytes) = 0;
  /// What was being sent is lost. Called once for each on_port_open().
  virtual void on_port_lost(ReconnectingPort& port) = 0;
};

struct PortConfig {
  std::string path;
  unsigned baud = 38400;
  /// Pauses before the first, second, ... new attempt; the last one from then on.
  std::vector<std::chrono::milliseconds> pauses{std::chrono::seconds(1), std::chrono::seconds(2),
                                                std::chrono::seconds(5)};
};

class ReconnectingPort {
 public:
  /// Opens the device; one that is not there is waited for from start() on.
  /// @throws std::runtime_error  one line: no permission, in use, no serial device
  ReconnectingPort(boost::asio::io_context& io, PortConfig config, PortUser& user);

  void start();

  bool is_open() const { return device_.is_open(); }
  const std::string& path() const { return config_.path; }
  /// "" while it is open, else why not and what is done about it.
  const std::string& problem() const { return problem_; }
  std::uint64_t losses() const { return losses_; }
  /// Programs that had it open too when it was opened, and still have: "pid 123 (cat)"; else "".
  std::string others() const;

  /// @return bytes taken. When the device turns out to be gone, on_port_lost() follows later.
  std::size_t write(std::span<const std::uint8_t> bytes);
  bool is_drained() const { return device_.is_drained(); }

  /// Gives the device up, for this reason, and opens it again.
  void fail(const std::string& reason);

 private:
  void look_for_others();
  void on_open();
  void on_readable();
  void fail_later(int error);
  void schedule_attempt();
  void attempt();

  PortConfig config_;
  PortUser& user_;
  SerialDevice device_;
  loop::Descriptor watched_;  // a duplicate: readiness only
  loop::Timer retry_timer_;
  std::string problem_;
  std::vector<serial::Holder> others_;
  std::size_t attempts_ = 0;
  std::uint64_t losses_ = 0;
  bool is_failing_ = false;
  int error_ = 0;           // with which it fails
  loop::Deferred failing_;  // fail(), at the end of a turn
};

}  // namespace swarmtalk::kilobot_bridge
