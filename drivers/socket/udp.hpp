// UdpLink: the same air frames as the payload of UDP datagrams, to a multicast group or a broadcast
// address. For several robots on one machine and for networks that filter unknown EtherTypes.
// Needs no privilege. TTL 1: frames stay on the local network.
#pragma once

#include <netinet/in.h>

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "drivers/socket/interface_watch.hpp"
#include "drivers/socket/socket_link.hpp"

namespace swarmtalk::drivers {

struct UdpConfig {
  /// Multicast group (the default is in the local scope of RFC 2365), or a broadcast address such
  /// as 192.168.1.255 or 127.255.255.255.
  std::string address = "239.255.83.84";
  std::uint16_t port = 21332;  // "ST"
  std::string interface;       // "wlan0", "lo"; empty: where the routing table sends the group
  frame::ProfileId profile = frame::ProfileId::kWifi;
  std::size_t max_packet_bytes = 1400;  // the profile's MTU
  PacerConfig pacer;
  std::optional<std::size_t> receive_buffer_bytes = {};  // none: kUsualReceiveBufferBytes
};

class UdpLink final : public SocketLink {
 public:
  static constexpr std::size_t kMaxFrameBytes = 1472;     // Ethernet's 1500 less IP and UDP headers
  static constexpr std::size_t kMaxDatagramBytes = 2048;  // longer ones are not of a UdpLink

  /// An interface that is not there is waited for: missing().
  /// @throws std::runtime_error  one line with the remedy: bad address, port taken by a program
  ///   that does not share it
  UdpLink(boost::asio::io_context& io, const UdpConfig& config);

  std::string type() const override { return "udp"; }
  std::string device() const override;  // "239.255.83.84:21332 on lo"
  std::string hardware_text(std::uint64_t hardware) const override;
  LinkSettings settings() const override;

 private:
  std::optional<std::span<const std::uint8_t>> air_frame(const Datagram& datagram) override;
  std::uint64_t hardware_of(const Datagram& datagram) const override;
  void refresh() override;
  std::uint64_t kernel_drops() const override;

  void open_receiving();
  bool bind_receiving();
  bool is_lost(const InterfaceInfo& interface) const;
  bool has_no_address(const InterfaceInfo& interface) const;
  void open_sending();
  bool join_group(const InterfaceInfo& interface);

  UdpConfig config_;
  std::size_t given_buffer_bytes_ = 0;
  sockaddr_in destination_{};
  int receive_socket_ = -1;  // bound to the group's port, which others on this machine share
  bool is_bound_ = false;    // the one to receive
  int send_socket_ = -1;     // its port is ours alone: so we know our own frames
  in_port_t own_port_ = 0;   // network byte order
};

}  // namespace swarmtalk::drivers
