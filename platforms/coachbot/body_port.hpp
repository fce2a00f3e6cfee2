// The body of a robot, reached at a Unix datagram socket: one command a datagram, as text.
//   vel LEFT RIGHT      wheels, -100 to 100 percent of full; stops by itself after 1 s
//   led RED GREEN BLUE  0 to 100 percent
// These are a Coachbot's set_vel() and set_led(), so what listens there is a simulated body
// (swarmtalk-suite-bodies) or a few lines of Python on a robot. One per process; any one thread.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>

#include "platforms/robot.hpp"

namespace swarmtalk::platforms {

/// A body stops if it hears nothing for so long.
constexpr uint64_t kBodyStopsUs = 1000000;

/// Address of a Unix socket. @throws std::runtime_error when the path is too long
inline sockaddr_un body_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    throw std::runtime_error(path + ": too long for a socket, at most 107 bytes");
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

class BodyPort {
 public:
  /// @throws std::runtime_error when nobody listens at `path`
  explicit BodyPort(const std::string& path)
      : fd_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const sockaddr_un address = body_address(path);
    if (fd_ < 0 || connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      const std::string cause = std::strerror(errno);
      if (fd_ >= 0) close(fd_);
      throw std::runtime_error("no body at " + path + ": " + cause);
    }
  }
  ~BodyPort() { close(fd_); }
  BodyPort(const BodyPort&) = delete;
  BodyPort& operator=(const BodyPort&) = delete;

  /// Wheel speeds, -1 to 1 of full.
  void drive(double left, double right) {
    send(std::snprintf(text_, sizeof text_, "vel %.0f %.0f", left * 100, right * 100));
  }
  void led(Colour colour) {
    send(std::snprintf(text_, sizeof text_, "led %d %d %d", percent(colour.red),
                       percent(colour.green), percent(colour.blue)));
  }

  /// Commands that could not be handed over: the body has gone, or does not read.
  uint32_t unsent() const { return unsent_; }

 private:
  static int percent(uint8_t level) { return level * 100 / 255; }
  void send(int size) {
    if (::send(fd_, text_, static_cast<size_t>(size), MSG_NOSIGNAL) != size) ++unsent_;
  }

  int fd_;
  char text_[40];
  uint32_t unsent_ = 0;
};

}  // namespace swarmtalk::platforms
