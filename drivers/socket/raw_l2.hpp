// RawL2Link: broadcast frames of our own EtherType on one Ethernet or Wi-Fi interface (AF_PACKET).
//
// The constructor does all that needs a privilege (CAP_NET_RAW); after it the process may drop
// every capability. The one descriptor survives its interface: when it goes down, is deleted and
// re-created, changes its MTU, or comes after the start, the same socket is bound again, without
// any privilege.
//
// The socket is SOCK_RAW, not SOCK_DGRAM: the kernel then runs the filter on the frame from its
// Ethernet header, which is what libpcap compiles "ether proto" for.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "drivers/socket/interface_watch.hpp"
#include "drivers/socket/socket_link.hpp"
#include "nl80211/radio.hpp"

namespace swarmtalk::drivers {

struct RawL2Config {
  std::string interface;  // "wlan0"
  std::uint16_t ethertype = frame::kDefaultEthertype;
  frame::ProfileId profile = frame::ProfileId::kWifi;
  std::size_t max_packet_bytes = 1400;  // the profile's MTU
  PacerConfig pacer;
  std::optional<std::size_t> receive_buffer_bytes = {};  // none: kUsualReceiveBufferBytes
};

class RawL2Link final : public SocketLink {
 public:
  /// An interface that is not there is waited for: missing().
  /// @throws std::runtime_error  one line with the remedy: not Ethernet, no permission, EtherType
  ///   below 0x0600
  RawL2Link(boost::asio::io_context& io, const RawL2Config& config);

  std::string type() const override { return "raw_l2"; }
  std::string device() const override { return config_.interface; }
  std::string hardware_text(std::uint64_t hardware) const override;
  LinkSettings settings() const override;
  Signals signals() override;

 private:
  static constexpr std::size_t kEthernetHeaderBytes = 14;

  bool is_of_another_vlan(const Datagram& datagram) const override;
  std::optional<std::span<const std::uint8_t>> air_frame(const Datagram& datagram) override;
  std::uint64_t hardware_of(const Datagram& datagram) const override;
  std::size_t medium_header_bytes() const override { return kEthernetHeaderBytes; }
  void refresh() override;
  std::uint64_t kernel_drops() const override;

  InterfaceInfo followed_interface() const;
  bool bind_to(const InterfaceInfo& interface);
  void write_ethernet_header(const InterfaceInfo& interface);

  RawL2Config config_;
  std::size_t given_buffer_bytes_ = 0;
  std::unique_ptr<nl80211::KernelAsker> radio_;  // opened when somebody asks for signals
  int socket_ = -1;
  unsigned bound_index_ = 0;  // 0: the interface is not there
  std::array<std::uint8_t, 6> own_mac_{};
  mutable std::uint64_t kernel_drops_ = 0;  // the kernel's own count restarts at each reading
};

}  // namespace swarmtalk::drivers
