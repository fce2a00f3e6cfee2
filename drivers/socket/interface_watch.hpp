// InterfaceWatch: what a network interface is like, and word of every change of it or of its IPv4
// addresses (a route socket).
// Needs no privilege. The change message itself is not read: it only says "look again", so a burst
// of changes or a lost message cannot leave a link with a wrong picture.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <string>

#include "interface/interface_info.hpp"
#include "loop/loop.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::drivers {

/// Why no robot is reached or heard through an interface that there is, and what to do about it:
/// "is switched off (ip link set wlan0 up)". Empty: nothing is in the way.
std::string obstacle_of(const InterfaceInfo& interface);

/// What to say of an interface that is up and may not reach all: ", dormant: ...". Mostly empty.
std::string remark_on(const InterfaceInfo& interface);

class InterfaceWatch {
 public:
  /// Opens the route socket in the calling thread's network namespace.
  /// @throws std::runtime_error
  explicit InterfaceWatch(boost::asio::io_context& io);

  /// Calls `on_change` after each change of any interface or IPv4 address, until this is destroyed.
  void start(std::function<void()> on_change);

  /// Calls `on_change` once more in two seconds: of some changes, such as `rfkill unblock` and
  /// those of routes, there is no word.
  void look_later();

  InterfaceInfo find(const std::string& name) const { return asker_.find(name); }
  InterfaceInfo find(unsigned index) const { return asker_.find(index); }
  bool lacks_source(unsigned index, std::uint32_t destination) const {
    return asker_.lacks_source(index, destination);
  }
  bool is_broadcast(unsigned index, std::uint32_t destination) const {
    return asker_.is_broadcast(index, destination);
  }

  /// Names of this machine's interfaces: "eth0, lo".
  static std::string names();

 private:
  void drain();

  InterfaceAsker asker_;
  loop::Descriptor socket_;
  loop::Timer later_;
  std::function<void()> on_change_;
};

}  // namespace swarmtalk::drivers
