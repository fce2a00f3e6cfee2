// UdpPort: where one robot's frames enter and leave the medium without any privilege: the daemon's
// UDP link on the loopback interface, with a multicast group for each robot. What the daemon sends
// to its group is read here; what is written here goes to that group, and the daemon hears it.
#pragma once

#include <netinet/in.h>

#include <string>

#include "lab/radio/port.hpp"

namespace swarmtalk::lab::radio {

/// The group of a robot, in the local scope of RFC 2365: "239.255.84.7". @param number  1..255
std::string group_of(int number);

class UdpPort final : public Port {
 public:
  /// @throws std::runtime_error  one line: no socket, no such group on the loopback interface
  UdpPort(int number, std::uint16_t udp_port);
  ~UdpPort() override;
  UdpPort(const UdpPort&) = delete;
  UdpPort& operator=(const UdpPort&) = delete;

  int descriptor() const override { return receiving_; }
  std::size_t read(std::span<std::uint8_t> buffer) override;
  bool write(std::span<const std::uint8_t> frame) override;
  std::uint64_t dropped_frames() const override;

 private:
  void open_receiving();
  void open_sending();

  sockaddr_in group_{};
  int receiving_ = -1;
  int sending_ = -1;
  in_port_t own_port_ = 0;  // network byte order: what comes from it is what we wrote
};

}  // namespace swarmtalk::lab::radio
