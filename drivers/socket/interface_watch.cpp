#include "drivers/socket/interface_watch.hpp"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <utility>

namespace swarmtalk::drivers {

InterfaceWatch::InterfaceWatch(boost::asio::io_context& io)
    : socket_(loop::Loop::of(io),
              [this](std::uint32_t) {
                drain();
                on_change_();
              }),
      later_(io, [this] { on_change_(); }) {
  socket_.own(open_route_socket(RTMGRP_LINK | RTMGRP_IPV4_IFADDR));
}

void InterfaceWatch::start(std::function<void()> on_change) {
  on_change_ = std::move(on_change);
  socket_.watch(EPOLLIN);
}

void InterfaceWatch::look_later() {
  if (on_change_ && !later_.is_armed()) later_.after(std::chrono::seconds(2));
}

void InterfaceWatch::drain() {
  std::array<char, 8192> bytes;
  // ENOBUFS says that messages were lost, which is news as well; whatever else is no reason to
  // stop.
  while (recv(socket_.fd(), bytes.data(), bytes.size(), MSG_DONTWAIT) >= 0 || errno == ENOBUFS ||
         errno == EINTR) {
  }
}

std::string obstacle_of(const InterfaceInfo& interface) {
  const std::string switch_on = "ip link set " + interface.name + " up";
  if (interface.block == RadioBlock::kSoft) {
    return "is blocked by rfkill (rfkill unblock wifi, then " + switch_on +
           "; on a Raspberry Pi first set the country: raspi-config nonint do_wifi_country CC)";
  }
  if (interface.block == RadioBlock::kHard) {
    return "is blocked by a switch of this machine (turn that on, then " + switch_on + ")";
  }
  if (!interface.is_switched_on) return "is switched off (" + switch_on + ")";
  if (!interface.bridge.empty()) {
    return "is a port of " + interface.bridge + ", which takes all its frames (set interface = \"" +
           interface.bridge + "\")";
  }
  if (!interface.has_carrier) return "has no carrier (plug in its cable, or join its Wi-Fi)";
  // The kernel drops what an unauthorised station sends; on a cable that is left to the switch.
  if (interface.is_dormant && interface.is_radio) {
    return "is dormant: no supplicant has authorised it (look at wpa_supplicant; without one: "
           "ip link set " +
           interface.name + " mode default state up)";
  }
  return {};
}

std::string remark_on(const InterfaceInfo& interface) {
  if (!interface.is_dormant) return {};
  return ", dormant: no supplicant has authorised it (802.1X: look at wpa_supplicant; else ip link "
         "set " +
         interface.name + " mode default state up)";
}

std::string InterfaceWatch::names() {
  std::string names;
  struct if_nameindex* const list = ::if_nameindex();
  for (const struct if_nameindex* entry = list; entry != nullptr && entry->if_index != 0; ++entry) {
    if (!names.empty()) names += ", ";
    names += entry->if_name;
  }
  if (list != nullptr) if_freenameindex(list);
  return names.empty() ? "none" : names;
}

}  // namespace swarmtalk::drivers
