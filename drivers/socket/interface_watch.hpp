// InterfaceWatch: what a network interface is like, and word of every change (a route socket).
// Needs no privilege. The change message itself is not read: it only says "look again", so a burst
// of changes or a lost message cannot leave a link with a wrong picture.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace swarmtalk::drivers {

struct InterfaceInfo {
  unsigned index = 0;  // 0: there is no such interface, and the rest means nothing
  std::string name;
  bool is_switched_on = false;  // ip link set NAME up
  bool has_carrier = false;
  bool is_loopback = false;
  bool is_ethernet = false;  // Wi-Fi counts as Ethernet
  std::size_t mtu_bytes = 0;
  std::array<std::uint8_t, 6> mac{};
};

/// Whether the kernel calls it 802.11: a Wi-Fi interface, in whatever mode.
bool is_radio(const std::string& interface);

class InterfaceWatch {
 public:
  /// Opens the route socket in the calling thread's network namespace.
  /// @throws std::runtime_error
  explicit InterfaceWatch(boost::asio::io_context& io);

  /// Calls `on_change` after each change of any interface, until this is destroyed.
  void start(std::function<void()> on_change);

  InterfaceInfo find(const std::string& name) const;
  InterfaceInfo find(unsigned index) const;

  /// Names of this machine's interfaces: "eth0, lo".
  static std::string names();

 private:
  void wait();
  void drain();

  int descriptor_;  // of socket_, for calls that only read
  boost::asio::posix::stream_descriptor socket_;
  std::function<void()> on_change_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);  // handlers outlive the watch
};

}  // namespace swarmtalk::drivers
