#include "redundancy/repairs.hpp"

#include <algorithm>

#include "redundancy/wifi_packet.hpp"

namespace swarmtalk::redundancy {
namespace {

// In front of each packet of a frame (docs/wire-format.md).
constexpr std::size_t kLengthPrefixBytes = 2;

}  // namespace

bool Repairs::is_copy_due(std::uint64_t now_us) const {
  const auto due_us = sender_.next_due_us();
  return due_us && *due_us <= now_us;
}

bool Repairs::has_copy_within(std::size_t room_bytes) const {
  const auto bytes = sender_.copy_bytes(frame_);
  return bytes && *bytes <= room_bytes;
}

std::size_t Repairs::waiting_bytes(std::size_t node_bytes, std::uint64_t now_us) {
  relay_.drop_late(now_us);
  if (sender_.has_parity()) return sender_.parity_bytes();
  if (is_copy_due(now_us)) return sender_.copy_bytes(UINT64_MAX).value_or(0);
  if (node_bytes != 0) return node_bytes;
  return relay_.has_packet() ? relay_.packet_bytes() : 0;
}

Repairs::Next Repairs::choose(std::size_t node_bytes, std::size_t room_bytes,
                              std::uint64_t now_us) const {
  if (is_closed_) return has_copy_within(room_bytes) ? Next::kCopy : Next::kNothing;
  if (!has_packets_) {
    if (sender_.has_parity()) {
      return sender_.parity_bytes() <= room_bytes ? Next::kParity : Next::kNothing;
    }
    if (is_copy_due(now_us) && has_copy_within(room_bytes)) return Next::kCopy;
    if (relay_.has_packet() && (node_bytes == 0 || is_relays_turn_)) {
      return relay_.packet_bytes() <= room_bytes ? Next::kForward : Next::kNothing;
    }
  }
  if (node_bytes == 0) {
    return has_packets_ && has_copy_within(room_bytes) ? Next::kCopy : Next::kNothing;
  }
  if (node_bytes > room_bytes) return Next::kNothing;
  const std::size_t beside = room_bytes - node_bytes;
  const bool rides = beside > kLengthPrefixBytes && has_copy_within(beside - kLengthPrefixBytes);
  return rides ? Next::kCopy : Next::kNode;
}

std::size_t Repairs::take(Next next, std::span<std::uint8_t> packet, std::uint64_t now_us) {
  const bool is_first = !has_packets_;
  has_packets_ = has_packets_ || next != Next::kNothing;
  switch (next) {
    case Next::kNothing:
      return 0;
    case Next::kNode:
      if (is_first) is_relays_turn_ = true;
      if (!sender_.is_idle()) sender_.sent(packet, frame_, now_us);
      return packet.size();
    case Next::kParity:
      is_closed_ = true;
      return sender_.take_parity(packet, now_us);
    case Next::kForward:
      is_closed_ = true;
      is_relays_turn_ = false;
      return relay_.take(packet, now_us);
    case Next::kCopy:
      return sender_.take_copy(packet, frame_, now_us);
  }
  return 0;
}

std::vector<Bytes> Repairs::receive(std::span<const std::uint8_t> packet, bool was_refused,
                                    bool is_own, bool is_listening, std::uint64_t now_us) {
  if (!is_marked(packet)) return {};
  const Header header = Wire::decode(packet.data());
  if (was_refused) {
    if (!is_parity(packet, header)) return {};
    ++received_;
    if (is_own) return {};
    relay_.offer(packet, header, now_us);
  }
  if (is_own || !is_listening || source_packets(header) == 1) return {};
  return recoverer_.add(packet, header, now_us);
}

}  // namespace swarmtalk::redundancy
