#include "drivers/socket/interface_watch.hpp"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace swarmtalk::drivers {
namespace {

int open_route_socket() {
  const int socket = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE);
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = RTMGRP_LINK;
  if (socket < 0 || bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    const std::string reason = std::strerror(errno);
    if (socket >= 0) close(socket);
    throw std::runtime_error("cannot watch the network interfaces: " + reason);
  }
  return socket;
}

/// Fills all but index and name. @return false: it vanished meanwhile
bool read_properties(int socket, InterfaceInfo& info) {
  ifreq request{};
  std::memcpy(request.ifr_name, info.name.c_str(),
              std::min<std::size_t>(info.name.size(), IFNAMSIZ - 1));
  if (ioctl(socket, SIOCGIFFLAGS, &request) != 0) return false;
  info.is_switched_on = (request.ifr_flags & IFF_UP) != 0;
  info.has_carrier = (request.ifr_flags & IFF_RUNNING) != 0;
  info.is_loopback = (request.ifr_flags & IFF_LOOPBACK) != 0;
  if (ioctl(socket, SIOCGIFMTU, &request) != 0) return false;
  info.mtu_bytes = static_cast<std::size_t>(std::max(request.ifr_mtu, 0));
  if (ioctl(socket, SIOCGIFHWADDR, &request) != 0) return false;
  info.is_ethernet = request.ifr_hwaddr.sa_family == ARPHRD_ETHER;
  std::memcpy(info.mac.data(), request.ifr_hwaddr.sa_data, info.mac.size());
  return true;
}

}  // namespace

InterfaceWatch::InterfaceWatch(boost::asio::io_context& io)
    : descriptor_(open_route_socket()), socket_(io, descriptor_) {}

void InterfaceWatch::start(std::function<void()> on_change) {
  on_change_ = std::move(on_change);
  wait();
}

void InterfaceWatch::wait() {
  socket_.async_wait(
      boost::asio::posix::stream_descriptor::wait_read,
      [this, alive = std::weak_ptr<bool>(alive_)](const boost::system::error_code& error) {
        if (alive.expired() || error) return;
        drain();
        on_change_();
        wait();
      });
}

void InterfaceWatch::drain() {
  std::array<char, 8192> bytes;
  // ENOBUFS says that messages were lost, which is news as well; whatever else is no reason to
  // stop.
  while (recv(descriptor_, bytes.data(), bytes.size(), MSG_DONTWAIT) >= 0 || errno == ENOBUFS ||
         errno == EINTR) {
  }
}

bool is_radio(const std::string& interface) {
  // A name with a slash is none, and would lead elsewhere.
  if (interface.empty() || interface.find('/') != std::string::npos) return false;
  struct stat status {};
  return ::stat(("/sys/class/net/" + interface + "/phy80211").c_str(), &status) == 0;
}

InterfaceInfo InterfaceWatch::find(const std::string& name) const {
  InterfaceInfo info;
  if (name.empty() || name.size() >= IFNAMSIZ) return info;
  ifreq request{};
  std::memcpy(request.ifr_name, name.c_str(), name.size());
  if (ioctl(descriptor_, SIOCGIFINDEX, &request) != 0) return info;
  info.name = name;
  if (read_properties(descriptor_, info)) info.index = static_cast<unsigned>(request.ifr_ifindex);
  return info;
}

InterfaceInfo InterfaceWatch::find(unsigned index) const {
  ifreq request{};
  request.ifr_ifindex = static_cast<int>(index);
  if (index == 0 || ioctl(descriptor_, SIOCGIFNAME, &request) != 0) return {};
  return find(std::string(request.ifr_name, strnlen(request.ifr_name, IFNAMSIZ)));
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
