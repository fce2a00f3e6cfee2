#include "lab/wifi/medium/hwsim_socket.hpp"

#include <netlink/genl/ctrl.h>
#include <netlink/genl/genl.h>
#include <netlink/netlink.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

namespace swarmtalk::wifi {
namespace {

constexpr const char* kFamily = "MAC80211_HWSIM";
constexpr int kBufferBytes = 4 << 20;

enum Command : std::uint8_t { kRegister = 1, kFrame = 2, kTxInfoFrame = 3 };

enum Attribute {
  kReceiver = 1,
  kTransmitter = 2,
  kFrameBytes = 3,
  kFlags = 4,
  kRxRate = 5,
  kSignal = 6,
  kTxInfo = 7,
  kCookie = 8,
  kFrequency = 19,
  kLastAttribute = 32
};

constexpr std::uint32_t kFlagNoAck = 1u << 1;
constexpr std::uint32_t kFlagAcknowledged = 1u << 2;

/// As in the attribute kTxInfo: four of these.
struct WireAttempt {
  std::int8_t rate_index;
  std::uint8_t tries;
};
static_assert(sizeof(WireAttempt) == 2, "two bytes an attempt, without padding");

Address address_in(const nlattr* attribute) {
  Address address{};
  if (attribute != nullptr && nla_len(attribute) == static_cast<int>(address.size())) {
    std::memcpy(address.data(), nla_data(attribute), address.size());
  }
  return address;
}

std::string words(int error) {
  return nl_geterror(error);
}

}  // namespace

struct HwsimSocket::Parts {
  nl_sock* socket = nullptr;
  int family = 0;
  const OnFrame* on_frame = nullptr;
  Air* air = nullptr;

  ~Parts() {
    if (socket != nullptr) nl_socket_free(socket);
  }

  void take(nlmsghdr* header) const {
    nlattr* attributes[kLastAttribute + 1];
    if (genlmsg_parse(header, 0, attributes, kLastAttribute, nullptr) < 0) return;
    const auto* generic = static_cast<const genlmsghdr*>(nlmsg_data(header));
    if (generic->cmd != kFrame || attributes[kFrameBytes] == nullptr || on_frame == nullptr) return;
    Frame frame;
    Ticket ticket;
    ticket.transmitter = frame.transmitter = address_in(attributes[kTransmitter]);
    if (attributes[kFlags] != nullptr) ticket.flags = nla_get_u32(attributes[kFlags]);
    if (attributes[kCookie] != nullptr) ticket.cookie = nla_get_u64(attributes[kCookie]);
    if (attributes[kFrequency] != nullptr) {
      frame.frequency_mhz = nla_get_u32(attributes[kFrequency]);
    }
    frame.wants_no_ack = (ticket.flags & kFlagNoAck) != 0;
    frame.bytes = {static_cast<const std::uint8_t*>(nla_data(attributes[kFrameBytes])),
                   static_cast<std::size_t>(nla_len(attributes[kFrameBytes]))};
    if (const nlattr* info = attributes[kTxInfo]; info != nullptr) {
      std::array<WireAttempt, 4> attempts{};
      const auto size =
          std::min<std::size_t>(sizeof attempts, static_cast<std::size_t>(nla_len(info)));
      std::memcpy(attempts.data(), nla_data(info), size);
      for (std::size_t i = 0; i < attempts.size(); ++i) {
        frame.attempts[i] = {attempts[i].rate_index, attempts[i].tries};
      }
    }
    (*on_frame)(frame, ticket);
  }

  /// A message of ours under way; sent by its destructor's caller, send().
  nl_msg* begin(std::uint8_t command) const {
    nl_msg* message = nlmsg_alloc();
    if (message == nullptr) throw std::runtime_error("out of memory");
    genlmsg_put(message, NL_AUTO_PORT, NL_AUTO_SEQ, family, 0, 0, command, 1);
    return message;
  }

  int send(nl_msg* message) const {
    const int result = nl_send_auto(socket, message);
    nlmsg_free(message);
    return result;
  }
};

HwsimSocket::HwsimSocket() : parts_(std::make_unique<Parts>()) {
  parts_->socket = nl_socket_alloc();
  if (parts_->socket == nullptr) throw std::runtime_error("out of memory");
  nl_sock* const socket = parts_->socket;
  if (const int error = genl_connect(socket); error < 0) {
    throw std::runtime_error("netlink: " + words(error));
  }
  parts_->family = genl_ctrl_resolve(socket, kFamily);
  if (parts_->family < 0) {
    throw std::runtime_error("this kernel has no simulated radios; modprobe mac80211_hwsim");
  }
  const int error = nl_send_sync(socket, parts_->begin(kRegister));
  if (error < 0) {
    throw std::runtime_error("the kernel takes no medium from this process: " + words(error) +
                             " (needs root; another medium may run)");
  }
  nl_socket_set_buffer_size(socket, kBufferBytes, kBufferBytes);
  nl_socket_disable_seq_check(socket);
  nl_socket_disable_auto_ack(socket);
  nl_socket_set_nonblocking(socket);
  nl_socket_modify_cb(
      socket, NL_CB_VALID, NL_CB_CUSTOM,
      [](nl_msg* message, void* parts) {
        static_cast<const Parts*>(parts)->take(nlmsg_hdr(message));
        return static_cast<int>(NL_OK);
      },
      parts_.get());
  nl_socket_modify_err_cb(
      socket, NL_CB_CUSTOM,
      [](sockaddr_nl*, nlmsgerr*, void* parts) {
        if (Air* air = static_cast<const Parts*>(parts)->air; air != nullptr) air->refused();
        return static_cast<int>(NL_SKIP);
      },
      parts_.get());
}

HwsimSocket::~HwsimSocket() = default;

int HwsimSocket::fd() const {
  return nl_socket_get_fd(parts_->socket);
}

void HwsimSocket::read(const OnFrame& on_frame, Air& air) {
  parts_->on_frame = &on_frame;
  parts_->air = &air;
  if (nl_recvmsgs_default(parts_->socket) == -NLE_NOMEM) air.overrun();
  parts_->on_frame = nullptr;
  parts_->air = nullptr;
}

void HwsimSocket::deliver(const Frame& frame, const Address& receiver, int rate_index,
                          int signal_dbm) {
  nl_msg* message = parts_->begin(kFrame);
  nla_put(message, kReceiver, static_cast<int>(receiver.size()), receiver.data());
  nla_put(message, kFrameBytes, static_cast<int>(frame.bytes.size()), frame.bytes.data());
  nla_put_u32(message, kRxRate, static_cast<std::uint32_t>(std::max(rate_index, 0)));
  nla_put_u32(message, kSignal, static_cast<std::uint32_t>(signal_dbm));
  nla_put_u32(message, kFrequency, frame.frequency_mhz);
  parts_->send(message);
}

void HwsimSocket::report(const Ticket& ticket, const Outcome& outcome, int signal_dbm) {
  std::array<WireAttempt, 4> attempts{};
  for (std::size_t i = 0; i < attempts.size(); ++i) {
    attempts[i] = {static_cast<std::int8_t>(outcome.used[i].rate_index),
                   static_cast<std::uint8_t>(outcome.used[i].tries)};
  }
  const std::uint32_t flags = ticket.flags | (outcome.is_acknowledged ? kFlagAcknowledged : 0);
  nl_msg* message = parts_->begin(kTxInfoFrame);
  nla_put(message, kTransmitter, static_cast<int>(ticket.transmitter.size()),
          ticket.transmitter.data());
  nla_put_u32(message, kFlags, flags);
  nla_put_u64(message, kCookie, ticket.cookie);
  nla_put_u32(message, kSignal, static_cast<std::uint32_t>(signal_dbm));
  nla_put(message, kTxInfo, static_cast<int>(sizeof attempts), attempts.data());
  parts_->send(message);
}

}  // namespace swarmtalk::wifi
