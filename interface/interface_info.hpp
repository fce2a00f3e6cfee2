// InterfaceInfo: what the kernel says of a network interface (a route socket, and /sys for radios).
// Asked by the daemon's links and by doctor, on their own threads. Needs no privilege.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace swarmtalk {

/// What keeps a radio off (rfkill).
enum class RadioBlock {
  kNone,
  kSoft,  // rfkill unblock wifi
  kHard   // a switch of the machine
};

struct InterfaceInfo {
  unsigned index = 0;  // 0: there is no such interface, and the rest means nothing
  std::string name;
  bool is_switched_on = false;  // ip link set NAME up
  bool has_carrier = false;
  bool is_dormant = false;  // it has carrier, and waits until a supplicant has authorised it
  bool is_radio = false;    // 802.11, says the kernel
  RadioBlock block = RadioBlock::kNone;
  bool is_loopback = false;
  bool is_ethernet = false;  // Wi-Fi counts as Ethernet
  std::size_t mtu_bytes = 0;
  std::array<std::uint8_t, 6> mac{};
  unsigned bridge_index = 0;  // of the bridge that it is a port of; 0: of none
  std::string bridge;         // its name
};

/// From the kernel's answer to RTM_GETLINK. All but the bridge's name and what is of radios.
InterfaceInfo read_interface(std::span<const std::uint8_t> answer);

/// From the kernel's answer to RTM_GETROUTE: a route without an address to send from.
bool is_without_source(std::span<const std::uint8_t> answer);

/// From the same: where it leads is an address of this machine, or the broadcast address of one.
bool is_broadcast(std::span<const std::uint8_t> answer);

class InterfaceAsker {
 public:
  /// Opens a route socket in the calling thread's network namespace.
  /// @throws std::runtime_error
  InterfaceAsker();
  ~InterfaceAsker();
  InterfaceAsker(const InterfaceAsker&) = delete;
  InterfaceAsker& operator=(const InterfaceAsker&) = delete;

  InterfaceInfo find(const std::string& name) const;
  InterfaceInfo find(unsigned index) const;

  /// Whether datagrams leave through an interface from 0.0.0.0, so that each receiver drops them:
  /// neither it nor another interface has an IPv4 address for them.
  /// @param destination  network byte order
  bool lacks_source(unsigned index, std::uint32_t destination) const;
  /// Whether it is the broadcast address of a network of this interface, or of any if index is 0.
  bool is_broadcast(unsigned index, std::uint32_t destination) const;

 private:
  InterfaceInfo ask(unsigned index, const std::string& name) const;
  std::vector<std::uint8_t> ask_route(unsigned index, std::uint32_t destination) const;
  void complete(InterfaceInfo& info) const;

  int socket_;
};

/// Opens a route socket that hears of changes. @param groups  RTMGRP_..., or 0
/// @throws std::runtime_error
int open_route_socket(unsigned groups);

/// Whether the kernel calls it 802.11: a Wi-Fi interface, in whatever mode.
bool is_radio(const std::string& interface);

/// @param folder  with a folder for each interface
RadioBlock block_of(const std::string& interface, const std::string& folder = "/sys/class/net");

}  // namespace swarmtalk
