#include "drivers/socket/raw_l2.hpp"

#include <arpa/inet.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <spdlog/fmt/ranges.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "drivers/link/link_error.hpp"
#include "drivers/link/link_log.hpp"
#include "drivers/socket/ether_filter.hpp"
#include "drivers/socket/receive_buffer.hpp"

namespace swarmtalk::drivers {
namespace {

constexpr std::uint8_t kGroupBit = 1;                 // of an address's first byte
constexpr std::uint16_t kSmallestEthertype = 0x0600;  // below, the field is a length (IEEE 802.3)
// Of Ethernet and, as drivers set it, of Wi-Fi. Nothing longer is sent, whatever this interface
// takes: one of another robot drops what is longer than its own.
constexpr std::size_t kUsualMtuBytes = 1500;

void check(const RawL2Config& config, const InterfaceInfo& interface) {
  const std::string who = "raw_l2 '" + config.interface + "': ";
  if (config.ethertype < kSmallestEthertype) {
    throw LinkError(LinkSetting::kEthertype,
                    who + "ethertype " + fmt::format("{:#06x}", config.ethertype) +
                        " is a length in Ethernet; use 0x0600 or more, 0x88b5 is for experiments");
  }
  if (interface.index == 0) return;  // it may come
  if (interface.is_loopback) {
    throw LinkError(LinkSetting::kInterface,
                    who + "the loopback interface carries no layer-2 broadcast; use a " +
                        "udp link with interface = \"" + config.interface + "\"");
  }
  if (!interface.is_ethernet) {
    throw LinkError(LinkSetting::kInterface,
                    who + "not an Ethernet or Wi-Fi interface; use a udp link on it");
  }
}

std::uint64_t number_of(std::span<const std::uint8_t> mac) {
  std::uint64_t number = 0;
  for (const std::uint8_t byte : mac) number = number << 8 | byte;
  return number;
}

/// A packet socket that hears nothing yet: its protocol is 0 until the filter is in place.
int open_packet_socket(const std::string& interface) {
  const int socket = ::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket >= 0) return socket;
  const std::string who = "raw_l2 '" + interface + "': ";
  if (errno == EPERM || errno == EACCES) {
    throw LinkError(LinkSetting::kInterface,
                    who + "a packet socket needs CAP_NET_RAW" +
                        (geteuid() == 0 ? ", which this root lacks (a container?); "
                                        : "; start swarmtalkd by systemd or as root, or ") +
                        "use a udp link, which needs no privilege");
  }
  throw LinkError(LinkSetting::kNone, who + "cannot open a packet socket: " + std::strerror(errno));
}

void prepare_socket(int socket, const RawL2Config& config) {
  attach_locked_ether_filter(socket, config.ethertype);
  // A packet socket of one EtherType hears what comes in, and not what this machine sends. This
  // asks for it besides, and is not missed where the kernel does not know it: before Linux 4.20.
  const int on = 1;
  setsockopt(socket, SOL_PACKET, PACKET_IGNORE_OUTGOING, &on, sizeof on);
  enable_drop_counts(socket);
  enable_receive_stamps(socket);  // without them reception is timed when it is read
}

}  // namespace

RawL2Link::RawL2Link(boost::asio::io_context& io, const RawL2Config& config)
    : SocketLink(io, config.profile, config.max_packet_bytes, config.pacer), config_(config) {
  const InterfaceInfo interface = watch().find(config_.interface);
  check(config_, interface);
  socket_ = open_packet_socket(config_.interface);
  use_receive_socket(socket_);
  prepare_socket(socket_, config_);
  given_buffer_bytes_ = use_receive_buffer(*this, socket_, config_.receive_buffer_bytes);
  if (interface.index == 0) {
    wait_for_interface(config_.interface, "raw_l2 '" + config_.interface + "': no such interface");
  } else if (!bind_to(interface)) {
    throw LinkError(LinkSetting::kInterface,
                    "raw_l2 '" + config_.interface +
                        "': cannot bind to the interface: " + std::strerror(errno));
  }
}

bool RawL2Link::bind_to(const InterfaceInfo& interface) {
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(config_.ethertype);
  address.sll_ifindex = static_cast<int>(interface.index);
  if (bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) return false;
  bound_index_ = interface.index;
  return true;
}

InterfaceInfo RawL2Link::followed_interface() const {
  // The interface of the configured name; else the one we are bound to, which has been renamed.
  const InterfaceInfo named = watch().find(config_.interface);
  return named.index != 0 ? named : watch().find(bound_index_);
}

void RawL2Link::refresh() {
  const InterfaceInfo interface = followed_interface();
  const std::string name = "interface '" + config_.interface + "'";
  if (interface.index == 0) {
    bound_index_ = 0;
    return set_gone(config_.interface);
  }
  if (!interface.is_ethernet || interface.is_loopback) {
    return set_state(false, "down: " + name + " is not an Ethernet or Wi-Fi interface");
  }
  if (interface.index != bound_index_ && !bind_to(interface)) {
    return set_state(false, "down: cannot bind to " + name + ": " + std::strerror(errno));
  }
  write_ethernet_header(interface);
  set_limits(std::min(interface.mtu_bytes, kUsualMtuBytes),
             kEthernetHeaderBytes + std::max(interface.mtu_bytes, kUsualMtuBytes));
  const std::string renamed =
      interface.name == config_.interface ? "" : " (renamed to '" + interface.name + "')";
  if (const std::string obstacle = obstacle_of(interface); !obstacle.empty()) {
    return set_state(false, "down: " + name + renamed + " " + obstacle);
  }
  set_state(true, "up" + renamed + ", MTU " + std::to_string(interface.mtu_bytes) + " bytes" +
                      mtu_remark() + remark_on(interface));
}

void RawL2Link::write_ethernet_header(const InterfaceInfo& interface) {
  own_mac_ = interface.mac;
  set_own_hardware(number_of(own_mac_));
  std::array<std::uint8_t, kEthernetHeaderBytes> header;
  header.fill(0xFF);  // destination: broadcast
  std::copy(own_mac_.begin(), own_mac_.end(), header.begin() + ETH_ALEN);
  header[12] = static_cast<std::uint8_t>(config_.ethertype >> 8);
  header[13] = static_cast<std::uint8_t>(config_.ethertype);
  transmit_queue().set_medium_header(header);
}

// The kernel takes the tag off before our socket sees the frame, and leaves this mark: a frame to
// all, or to us, that is for another host. VLAN 0 is a priority and no VLAN; it has no mark.
bool RawL2Link::is_of_another_vlan(const Datagram& datagram) const {
  sockaddr_ll source;
  std::memcpy(&source, &datagram.source, sizeof source);
  if (source.sll_pkttype != PACKET_OTHERHOST || datagram.bytes.size() < ETH_ALEN) return false;
  const bool is_to_us = std::equal(own_mac_.begin(), own_mac_.end(), datagram.bytes.begin());
  return is_to_us || (datagram.bytes[0] & kGroupBit) != 0;
}

std::optional<std::span<const std::uint8_t>> RawL2Link::air_frame(const Datagram& datagram) {
  const std::span<const std::uint8_t> bytes = datagram.bytes;
  if (bytes.size() < kEthernetHeaderBytes) return bytes.first(0);
  // An access point repeats a station's broadcast to all, the station included.
  const bool is_own = std::equal(own_mac_.begin(), own_mac_.end(), bytes.begin() + ETH_ALEN);
  const std::span<const std::uint8_t> frame = bytes.subspan(kEthernetHeaderBytes);
  if (is_own && echoes().is_ours(frame, datagram.received_at)) return std::nullopt;
  return frame;
}

std::uint64_t RawL2Link::hardware_of(const Datagram& datagram) const {
  if (datagram.bytes.size() < kEthernetHeaderBytes) return 0;
  return number_of(datagram.bytes.subspan(ETH_ALEN, ETH_ALEN));
}

std::string RawL2Link::hardware_text(std::uint64_t hardware) const {
  std::array<std::uint8_t, ETH_ALEN> mac{};
  for (auto byte = mac.rbegin(); byte != mac.rend(); ++byte, hardware >>= 8) {
    *byte = static_cast<std::uint8_t>(hardware);
  }
  return fmt::format("{:02x}", fmt::join(mac, ":"));
}

LinkSettings RawL2Link::settings() const {
  LinkSettings settings;
  settings.is_sealed = is_sealed();
  settings.air_rate_mbps = air_rate_mbps();
  settings.forward_jitter = forward_jitter();
  settings.asked_buffer_bytes = config_.receive_buffer_bytes;
  settings.given_buffer_bytes = given_buffer_bytes_;
  settings.interface = config_.interface;
  settings.ethertype = config_.ethertype;
  return settings;
}

// A client hears all others through its access point, whose signal says nothing about them.
Signals RawL2Link::signals() {
  Signals signals;
  if (radio_ == nullptr) radio_ = std::make_unique<nl80211::KernelAsker>();
  if (!radio_->is_there() || bound_index_ == 0) return signals;
  const auto interface = nl80211::interface_of(*radio_, bound_index_);
  if (!interface || interface->mode == nl80211::Mode::kStation) return signals;
  const auto stations = nl80211::stations_of(*radio_, bound_index_);
  if (!stations) return signals;
  for (const nl80211::Station& each : *stations) {
    if (each.signal_dbm) signals.emplace_back(each.address, *each.signal_dbm);
  }
  return signals;
}

std::uint64_t RawL2Link::kernel_drops() const {
  tpacket_stats statistics{};
  socklen_t size = sizeof statistics;
  if (getsockopt(socket_, SOL_PACKET, PACKET_STATISTICS, &statistics, &size) == 0) {
    kernel_drops_ += statistics.tp_drops;
  }
  return kernel_drops_;
}

}  // namespace swarmtalk::drivers
