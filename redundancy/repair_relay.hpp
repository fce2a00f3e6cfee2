// RepairRelay: parity packets of others, sent on. Each at most once: what it has no memory left to
// remember is not sent on. Reads no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <unordered_map>

#include "redundancy/erasure_code.hpp"
#include "redundancy/wifi_packet.hpp"

namespace swarmtalk::redundancy {

class RepairRelay {
 public:
  static constexpr std::size_t kMostWaiting = 64;
  static constexpr std::size_t kMostRemembered = 4096;
  /// As long as a node remembers messages whose copies wander.
  static constexpr std::uint64_t kRememberUs = core::Wifi::kFloodTicks;

  /// As of a node: a packet is sent on as if it allowed at most `max_ttl` hops (0: none is), and
  /// not after it has waited for longer than `max_wait_us` (0: no limit).
  void limit(std::uint8_t max_ttl, std::uint64_t max_wait_us) {
    max_ttl_ = max_ttl;
    max_wait_us_ = max_wait_us;
  }

  /// A parity packet has come, of somebody else's message.
  void offer(std::span<const std::uint8_t> packet, const Header& header, std::uint64_t now_us);

  /// Gives up what has waited for too long.
  void drop_late(std::uint64_t now_us);
  bool has_packet() const { return !waiting_.empty(); }
  std::size_t packet_bytes() const { return waiting_.front().packet.size(); }
  /// @return bytes written to `out`. @pre has_packet(), and it fits
  std::size_t take(std::span<std::uint8_t> out, std::uint64_t now_us);

  std::uint64_t forwarded() const { return forwarded_; }
  std::uint64_t dropped() const { return dropped_; }

 private:
  struct Waiting {
    Bytes packet;
    std::uint64_t since_us = 0;
  };
  struct Hash {
    std::size_t operator()(const MessageName& name) const;
  };
  bool is_new(const Header& header, std::uint64_t now_us);
  void forget_old(std::uint64_t now_us);

  std::uint8_t max_ttl_ = 255;
  std::uint64_t max_wait_us_ = 0;
  std::deque<Waiting> waiting_;
  std::unordered_map<MessageName, std::uint32_t, Hash> seen_;   // one bit a parity packet
  std::deque<std::pair<std::uint64_t, MessageName>> in_order_;  // since when they are in it
  std::uint64_t forwarded_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace swarmtalk::redundancy
