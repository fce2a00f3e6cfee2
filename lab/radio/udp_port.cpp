#include "lab/radio/udp_port.hpp"

#include <arpa/inet.h>
#include <linux/sock_diag.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace swarmtalk::lab::radio {
namespace {

template <typename Value>
bool set_option(int socket, int level, int name, const Value& value) {
  return setsockopt(socket, level, name, &value, sizeof value) == 0;
}

int open_datagram_socket() {
  return socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
}

}  // namespace

std::string group_of(int number) {
  return "239.255.84." + std::to_string(number);
}

UdpPort::UdpPort(int number, std::uint16_t udp_port) {
  group_.sin_family = AF_INET;
  group_.sin_port = htons(udp_port);
  inet_pton(AF_INET, group_of(number).c_str(), &group_.sin_addr);
  try {
    open_receiving();
    open_sending();
  } catch (const std::runtime_error& error) {
    const std::string why = std::strerror(errno);
    if (receiving_ >= 0) close(receiving_);
    if (sending_ >= 0) close(sending_);
    throw std::runtime_error(error.what() + (" " + group_of(number)) + ": " + why);
  }
}

UdpPort::~UdpPort() {
  close(receiving_);
  close(sending_);
}

void UdpPort::open_receiving() {
  receiving_ = open_datagram_socket();
  ip_mreqn membership{};
  membership.imr_multiaddr = group_.sin_addr;
  membership.imr_ifindex = static_cast<int>(if_nametoindex("lo"));
  // The daemon is bound to the same place; each gets a copy of every datagram.
  if (receiving_ < 0 || !set_option(receiving_, SOL_SOCKET, SO_REUSEADDR, 1) ||
      !set_option(receiving_, IPPROTO_IP, IP_MULTICAST_ALL, 0) ||
      bind(receiving_, reinterpret_cast<const sockaddr*>(&group_), sizeof group_) != 0 ||
      !set_option(receiving_, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership)) {
    throw std::runtime_error("the medium cannot listen to the group");
  }
}

void UdpPort::open_sending() {
  sending_ = open_datagram_socket();
  ip_mreqn interface {};
  interface.imr_ifindex = static_cast<int>(if_nametoindex("lo"));
  sockaddr_in own{};
  own.sin_family = AF_INET;
  socklen_t size = sizeof own;
  if (sending_ < 0 || !set_option(sending_, IPPROTO_IP, IP_MULTICAST_IF, interface) ||
      bind(sending_, reinterpret_cast<sockaddr*>(&own), size) != 0 ||
      getsockname(sending_, reinterpret_cast<sockaddr*>(&own), &size) != 0) {
    throw std::runtime_error("the medium cannot send to the group");
  }
  own_port_ = own.sin_port;
}

std::size_t UdpPort::read(std::span<std::uint8_t> buffer) {
  for (;;) {
    sockaddr_in source{};
    socklen_t source_size = sizeof source;
    const ssize_t size = recvfrom(receiving_, buffer.data(), buffer.size(), 0,
                                  reinterpret_cast<sockaddr*>(&source), &source_size);
    if (size <= 0) return 0;
    if (source.sin_port != own_port_) return static_cast<std::size_t>(size);
  }
}

bool UdpPort::write(std::span<const std::uint8_t> frame) {
  return sendto(sending_, frame.data(), frame.size(), MSG_DONTWAIT,
                reinterpret_cast<const sockaddr*>(&group_),
                sizeof group_) == static_cast<ssize_t>(frame.size());
}

std::uint64_t UdpPort::dropped_frames() const {
  std::array<std::uint32_t, SK_MEMINFO_VARS> memory{};
  socklen_t size = sizeof memory;
  getsockopt(receiving_, SOL_SOCKET, SO_MEMINFO, memory.data(), &size);
  return memory[SK_MEMINFO_DROPS];
}

}  // namespace swarmtalk::lab::radio
