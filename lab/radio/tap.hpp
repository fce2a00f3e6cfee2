// Tap: an Ethernet interface of the kernel whose other end is ours: what a program sends on it can
// be read here, what is written here it receives. It goes when its owner does, however it ends.
#pragma once

#include <string>

#include "lab/radio/port.hpp"

namespace swarmtalk::lab::radio {

class Tap final : public Port {
 public:
  /// Makes the interface and switches it on. The caller's network namespace stays what it is.
  /// @param network_namespace  name under /run/netns
  /// @param number  last two bytes of the interface's address, 02:53:54:00:HI:LO
  /// @throws std::runtime_error  one line: no /dev/net/tun, no right, name taken
  Tap(const std::string& network_namespace, const std::string& interface, std::uint16_t number);
  ~Tap() override;
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;

  int descriptor() const override { return fd_; }
  std::size_t read(std::span<std::uint8_t> buffer) override;
  bool write(std::span<const std::uint8_t> frame) override;
  std::uint64_t dropped_frames() const override;

 private:
  std::string interface_;
  int fd_ = -1;
  int counters_fd_ = -1;  // /proc/net/dev of the interface's namespace
};

}  // namespace swarmtalk::lab::radio
