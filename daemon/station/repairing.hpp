// Repairing: what a station of profile P does about redundancy: which of its messages get repair
// packets, and what is made of those that come. Of the profile `wifi` only; in the others it is
// nothing. Owned by the station.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/message/redundancy.hpp"
#include "daemon/station/measured_loss.hpp"
#include "daemon/station/node_identity.hpp"
#include "drivers/link/link.hpp"
#include "loop/clock.hpp"
#include "redundancy/repairs.hpp"
#include "redundancy/wifi_packet.hpp"
#include "swarmtalk/types.hpp"

namespace swarmtalk::daemon {

static_assert(kMostRedundancy == redundancy::kMostRepairs);

template <class P>
class Repairing {
 public:
  static constexpr bool kIsThere = false;

  static constexpr bool is_idle() { return true; }
  static void want(std::uint8_t) {}
  static constexpr std::uint8_t take_wanted() { return 0; }
  static void protect(std::uint16_t, std::uint32_t, std::size_t, bool, std::uint8_t,
                      const Neighbours&) {}
  static void forget(std::uint16_t) {}
  static void repeats(std::uint16_t) {}
  static void limit_forwarding(const Forwarding&) {}
  static void begin_frame() {}
  static constexpr bool has_own() { return false; }
  static constexpr bool has_relayed() { return false; }
  static std::size_t waiting_bytes(std::size_t node_bytes, drivers::Link&) { return node_bytes; }
  static std::optional<std::size_t> pull(std::size_t, std::span<std::uint8_t>, drivers::Link&) {
    return std::nullopt;
  }
  static void sent(std::span<std::uint8_t>, drivers::Link&) {}
  static constexpr bool concerns(std::span<const std::uint8_t>) { return false; }
  template <class Node, class IsListening>
  static void receive(std::span<const std::uint8_t>, core::Error, const NodeIdentity&, IsListening,
                      Node) {}
  static constexpr std::uint64_t received() { return 0; }
  static void add_counters(drivers::Counters&) {}
};

template <>
class Repairing<core::Wifi> {
 public:
  static constexpr bool kIsThere = true;

  /// The node's packets may go past this.
  bool is_idle() const { return !is_busy_; }

  /// The message that is handed over next gets so many, or kAutoRedundancy.
  void want(std::uint8_t repairs) { wanted_ = repairs; }
  std::uint8_t take_wanted() { return std::exchange(wanted_, std::uint8_t{0}); }

  /// The node has taken a message. @param wanted  not 0
  void protect(std::uint16_t channel, std::uint32_t number, std::size_t bytes, bool is_timestamped,
               std::uint8_t wanted, const Neighbours& neighbours) {
    using W = redundancy::Wire;
    const unsigned packets =
        W::packets_for(static_cast<std::uint16_t>(bytes),
                       is_timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes);
    const unsigned repairs =
        wanted == kAutoRedundancy
            ? redundancy::repairs_for_loss(packets, loss_.of(neighbours, loop::now()))
            : std::min<unsigned>(wanted, redundancy::kMostRepairs);
    if (repairs == 0) return;
    repairs_.sender().protect(channel, number, repairs);
    is_busy_ = true;
  }
  void forget(std::uint16_t channel) { repairs_.sender().forget(channel); }
  void repeats(std::uint16_t channel) { repairs_.sender().repeats(channel); }

  void limit_forwarding(const Forwarding& forwarding) {
    repairs_.relay().limit(forwarding.is_on ? forwarding.max_ttl : std::uint8_t{0},
                           std::uint64_t{forwarding.max_wait_ms} * 1000);
  }

  void begin_frame() { repairs_.begin_frame(); }
  /// A parity packet of a message of this robot waits, or of one that it sends on. Late copies
  /// are neither: they have a time of their own.
  bool has_own() { return is_busy_ && repairs_.sender().has_parity(); }
  bool has_relayed() { return is_busy_ && repairs_.relay().has_packet(); }
  /// @param node_bytes  of the node's next packet; 0: none
  std::size_t waiting_bytes(std::size_t node_bytes, drivers::Link& link) {
    const std::size_t bytes = repairs_.waiting_bytes(node_bytes, now_us());
    settle(link);
    return bytes;
  }
  /// The next packet of the frame in hand. @return none: it is the node's turn
  std::optional<std::size_t> pull(std::size_t node_bytes, std::span<std::uint8_t> out,
                                  drivers::Link& link) {
    const redundancy::Repairs::Next next = repairs_.choose(node_bytes, out.size(), now_us());
    if (next == redundancy::Repairs::Next::kNode) return std::nullopt;
    const std::size_t bytes = repairs_.take(next, out, now_us());
    settle(link);
    return bytes;
  }
  /// The node has given this packet.
  void sent(std::span<std::uint8_t> packet, drivers::Link& link) {
    repairs_.take(redundancy::Repairs::Next::kNode, packet, now_us());
    settle(link);
  }

  static bool concerns(std::span<const std::uint8_t> packet) {
    return redundancy::is_marked(packet);
  }
  /// A packet that concerns this has come. @param result  the node's
  /// @param is_listening  whether the node puts messages of a channel together
  /// @param take          called with each packet that becomes known by it
  template <class IsListening, class Take>
  void receive(std::span<const std::uint8_t> packet, core::Error result,
               const NodeIdentity& identity, IsListening is_listening, Take take) {
    const redundancy::Header header = redundancy::Wire::decode(packet.data());
    const bool is_own = header.node == identity.id() &&
                        header.epoch == static_cast<std::uint16_t>(identity.epoch());
    for (const redundancy::Bytes& known : repairs_.receive(
             packet, result != core::Error::kOk, is_own, is_listening(header.channel), now_us())) {
      take(known);
    }
    is_busy_ = !repairs_.is_idle();
  }
  std::uint64_t received() const { return repairs_.received(); }
  void add_counters(drivers::Counters& counters) const {
    counters.insert(counters.end(), {{"repairs_sent", repairs_.sent()},
                                     {"repairs_received", repairs_.received()},
                                     {"repairs_forwarded", repairs_.forwarded()},
                                     {"repairs_dropped", repairs_.dropped()},
                                     {"packets_recovered", repairs_.recovered()}});
  }

 private:
  using Clock = std::chrono::steady_clock;

  static std::uint64_t now_us() {
    const auto since = loop::now().time_since_epoch();
    return static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::microseconds>(since).count());
  }
  /// A late copy that finds no frame to ride in leaves alone.
  void settle(drivers::Link& link) {
    is_busy_ = !repairs_.is_idle();
    const auto due_us = repairs_.sender().next_due_us();
    if (due_us) link.wake_at(Clock::time_point(std::chrono::microseconds(*due_us)));
  }

  redundancy::Repairs repairs_;
  MeasuredLoss loss_;
  std::uint8_t wanted_ = 0;
  bool is_busy_ = false;  // repairs_ may have something to send, or to make
};

}  // namespace swarmtalk::daemon
