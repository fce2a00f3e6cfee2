#include "drivers/socket/udp.hpp"

#include <arpa/inet.h>
#include <linux/sock_diag.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/link/link_error.hpp"
#include "drivers/socket/receive_buffer.hpp"

namespace swarmtalk::drivers {
namespace {

constexpr std::size_t kIpAndUdpHeaderBytes = 28;

template <typename Value>
bool set_option(int socket, int level, int name, const Value& value) {
  return setsockopt(socket, level, name, &value, sizeof value) == 0;
}

LinkError failure(const UdpConfig& config, LinkSetting blamed, const std::string& what) {
  return LinkError(blamed,
                   "udp '" + config.address + ":" + std::to_string(config.port) + "': " + what);
}

sockaddr_in parse_destination(const UdpConfig& config) {
  sockaddr_in destination{};
  destination.sin_family = AF_INET;
  destination.sin_port = htons(config.port);
  if (inet_pton(AF_INET, config.address.c_str(), &destination.sin_addr) != 1) {
    throw failure(config, LinkSetting::kAddress,
                  "not an IPv4 address; give a multicast group such as 239.255.83.84 or a "
                  "broadcast address");
  }
  if (config.port == 0) throw failure(config, LinkSetting::kPort, "port must be 1 to 65535");
  return destination;
}

int open_udp_socket(const UdpConfig& config) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, IPPROTO_UDP);
  if (socket < 0)
    throw failure(config, LinkSetting::kNone,
                  std::string("cannot open a socket: ") + std::strerror(errno));
  return socket;
}

/// Why the receiving socket cannot be bound, and which setting is to blame.
std::pair<LinkSetting, std::string> bind_problem(int error, std::uint16_t port) {
  switch (error) {
    case EADDRINUSE:
      return {LinkSetting::kPort,
              "the port is taken by a program that does not share it; choose another"};
    case EACCES:
    case EPERM:
      return {LinkSetting::kPort, "no permission to use port " + std::to_string(port) +
                                      "; choose one from 1024 on, or give swarmtalkd "
                                      "CAP_NET_BIND_SERVICE"};
    case EADDRNOTAVAIL:
      return {LinkSetting::kAddress,
              "neither a multicast group nor a broadcast address of this machine"};
    default:
      return {LinkSetting::kAddress, std::string("cannot bind: ") + std::strerror(error)};
  }
}

bool is_multicast(const sockaddr_in& address) {
  return IN_MULTICAST(ntohl(address.sin_addr.s_addr));
}

}  // namespace

UdpLink::UdpLink(boost::asio::io_context& io, const UdpConfig& config)
    : SocketLink(io, config.profile, config.max_packet_bytes, config.pacer, kIpAndUdpHeaderBytes),
      config_(config),
      destination_(parse_destination(config)) {
  receive_socket_ = open_udp_socket(config_);
  use_receive_socket(receive_socket_);
  send_socket_ = open_udp_socket(config_);
  use_send_socket(send_socket_);
  open_receiving();
  open_sending();
  transmit_queue().set_destination(destination_);
  if (config_.interface.empty() || watch().find(config_.interface).index != 0) return;
  wait_for_interface(
      config_.interface,
      failure(config_, LinkSetting::kInterface, "no interface '" + config_.interface + "'").what());
}

void UdpLink::open_receiving() {
  const int on = 1;
  const int off = 0;
  // Several daemons on one machine share the port; each gets a copy of every datagram.
  set_option(receive_socket_, SOL_SOCKET, SO_REUSEADDR, on);
  // Only groups joined by this socket, not by any program on this machine.
  set_option(receive_socket_, IPPROTO_IP, IP_MULTICAST_ALL, off);
  enable_receive_stamps(receive_socket_);
  enable_drop_counts(receive_socket_);
  given_buffer_bytes_ = use_receive_buffer(*this, receive_socket_, config_.receive_buffer_bytes);
  if (bind_receiving()) return;
  const int error = errno;
  // The broadcast address of a network is one of this machine's once it has an address there.
  const bool may_come =
      !config_.interface.empty() && has_no_address(watch().find(config_.interface));
  if (error != EADDRNOTAVAIL || !may_come) {
    const auto [blamed, what] = bind_problem(error, config_.port);
    throw failure(config_, blamed, what);
  }
}

bool UdpLink::bind_receiving() {
  const auto* const place = reinterpret_cast<const sockaddr*>(&destination_);
  is_bound_ = is_bound_ || bind(receive_socket_, place, sizeof destination_) == 0;
  return is_bound_;
}

// A broadcast address goes with the address that brought it; the sockets do not notice.
bool UdpLink::is_lost(const InterfaceInfo& interface) const {
  const std::uint32_t address = destination_.sin_addr.s_addr;
  return !is_multicast(destination_) && address != INADDR_BROADCAST &&
         !watch().is_broadcast(interface.index, address);
}

// The loopback interface needs none.
bool UdpLink::has_no_address(const InterfaceInfo& interface) const {
  return interface.index == 0 ||
         (!interface.is_loopback &&
          watch().lacks_source(interface.index, destination_.sin_addr.s_addr));
}

void UdpLink::open_sending() {
  const int on = 1;
  const int one_hop = 1;
  set_option(send_socket_, IPPROTO_IP, IP_MULTICAST_TTL, one_hop);
  set_option(send_socket_, IPPROTO_IP, IP_TTL, one_hop);
  set_option(send_socket_, IPPROTO_IP, IP_MULTICAST_LOOP, on);
  set_option(send_socket_, SOL_SOCKET, SO_BROADCAST, on);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  socklen_t size = sizeof own;
  if (bind(send_socket_, reinterpret_cast<sockaddr*>(&own), size) != 0 ||
      getsockname(send_socket_, reinterpret_cast<sockaddr*>(&own), &size) != 0) {
    throw failure(config_, LinkSetting::kNone,
                  std::string("cannot bind the sending socket: ") + std::strerror(errno));
  }
  own_port_ = own.sin_port;
}

std::string UdpLink::device() const {
  const std::string place = config_.address + ":" + std::to_string(config_.port);
  return config_.interface.empty() ? place : place + " on " + config_.interface;
}

bool UdpLink::join_group(const InterfaceInfo& interface) {
  ip_mreqn request{};
  request.imr_multiaddr = destination_.sin_addr;
  request.imr_ifindex = static_cast<int>(interface.index);
  const bool has_joined =
      set_option(receive_socket_, IPPROTO_IP, IP_ADD_MEMBERSHIP, request) || errno == EADDRINUSE;
  if (!has_joined || interface.index == 0) return has_joined;
  return set_option(send_socket_, IPPROTO_IP, IP_MULTICAST_IF, request);
}

void UdpLink::refresh() {
  std::size_t frame_bytes = kMaxFrameBytes;
  InterfaceInfo interface;
  if (!config_.interface.empty()) {
    interface = watch().find(config_.interface);
    const std::string name = "interface '" + config_.interface + "'";
    if (interface.index == 0) return set_gone(config_.interface);
    if (const std::string obstacle = obstacle_of(interface); !obstacle.empty()) {
      return set_state(false, "down: " + name + " " + obstacle);
    }
    frame_bytes = std::min(
        frame_bytes, std::max(interface.mtu_bytes, kIpAndUdpHeaderBytes) - kIpAndUdpHeaderBytes);
  }
  set_limits(frame_bytes, kMaxDatagramBytes);
  if (!is_multicast(destination_) && interface.index != 0) {
    // Else 255.255.255.255 leaves by the default route, or not at all. Made again with the
    // interface.
    const std::uint32_t index = htonl(interface.index);
    set_option(send_socket_, IPPROTO_IP, IP_UNICAST_IF, index);
  }
  if (is_multicast(destination_) && !join_group(interface)) {
    return set_state(false, std::string("down: cannot join the group: ") + std::strerror(errno) +
                                (config_.interface.empty() ? " (name an interface)" : ""));
  }
  if (interface.index != 0 && has_no_address(interface)) {
    return set_state(false, "down: interface '" + config_.interface +
                                "' has no IPv4 address yet (give it one, or wait for DHCP)");
  }
  if (!bind_receiving()) {
    return set_state(false, "down: " + bind_problem(errno, config_.port).second);
  }
  if (is_lost(interface)) {
    const std::string whose =
        interface.index == 0 ? "this machine" : "interface '" + config_.interface + "'";
    return set_state(false, "down: " + config_.address + " is no broadcast address of " + whose +
                                " now (give it its address, or wait for DHCP)");
  }
  set_state(true, "up, frames of up to " + std::to_string(frame_bytes) + " bytes" + mtu_remark() +
                      remark_on(interface));
}

std::optional<std::span<const std::uint8_t>> UdpLink::air_frame(const Datagram& datagram) {
  sockaddr_in source;
  std::memcpy(&source, &datagram.source, sizeof source);
  if (source.sin_port != own_port_) return datagram.bytes;
  // Another machine may use the same port number; its epoch is another.
  frame::Frame frame;
  const bool is_own = frame::parse(datagram.bytes, frame) == frame::ParseResult::kOk &&
                      frame.header.epoch == user()->frame_header().epoch;
  if (is_own) return std::nullopt;
  return datagram.bytes;
}

std::uint64_t UdpLink::hardware_of(const Datagram& datagram) const {
  sockaddr_in source;
  std::memcpy(&source, &datagram.source, sizeof source);
  return std::uint64_t{ntohl(source.sin_addr.s_addr)} << 16 | ntohs(source.sin_port);
}

LinkSettings UdpLink::settings() const {
  LinkSettings settings;
  settings.is_sealed = is_sealed();
  settings.air_rate_mbps = air_rate_mbps();
  settings.forward_jitter = forward_jitter();
  settings.asked_buffer_bytes = config_.receive_buffer_bytes;
  settings.given_buffer_bytes = given_buffer_bytes_;
  settings.interface = config_.interface;
  return settings;
}

std::string UdpLink::hardware_text(std::uint64_t hardware) const {
  const in_addr address{htonl(static_cast<std::uint32_t>(hardware >> 16))};
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address, text.data(), text.size());
  return std::string(text.data()) + ":" + std::to_string(hardware & 0xFFFF);
}

std::uint64_t UdpLink::kernel_drops() const {
  std::array<std::uint32_t, SK_MEMINFO_VARS> memory{};
  socklen_t size = sizeof memory;
  getsockopt(receive_socket_, SOL_SOCKET, SO_MEMINFO, memory.data(), &size);
  return memory[SK_MEMINFO_DROPS];
}

}  // namespace swarmtalk::drivers
