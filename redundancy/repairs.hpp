// Repairs: all that a station does about repair packets, beside a node that knows nothing of them.
// It says what goes next into the frame that is being filled, and takes in what the node has no use
// for. Rules: a parity packet never shares a frame with packets of its message, so it opens a frame
// and only late copies follow it; a late copy never shares a frame with the message that it copies,
// and goes in front of what is new, so that messages arrive in order. Reads no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "redundancy/recoverer.hpp"
#include "redundancy/repair_count.hpp"
#include "redundancy/repair_relay.hpp"
#include "redundancy/repair_sender.hpp"

namespace swarmtalk::redundancy {

class Repairs {
 public:
  enum class Next : std::uint8_t { kNothing, kNode, kParity, kCopy, kForward };

  /// @param copy_wait_us  see RepairSender
  explicit Repairs(std::uint64_t copy_wait_us = RepairSender::kCopyWaitUs)
      : sender_(copy_wait_us) {}

  /// Nothing to send, and nothing to make: the node's packets may go past this.
  bool is_idle() const { return sender_.is_idle() && !relay_.has_packet(); }

  RepairSender& sender() { return sender_; }
  RepairRelay& relay() { return relay_; }

  /// A frame is about to be filled.
  void begin_frame() {
    ++frame_;
    has_packets_ = is_closed_ = false;
  }

  /// Bytes of what is next, in this frame or the one after it; 0: nothing waits.
  /// @param node_bytes  of the node's next packet; 0: it has none
  std::size_t waiting_bytes(std::size_t node_bytes, std::uint64_t now_us);
  /// What goes into the frame next. @param room_bytes  that are left in it for a packet
  Next choose(std::size_t node_bytes, std::size_t room_bytes, std::uint64_t now_us) const;
  /// Writes it; with kNode the caller has. @param packet  room, or what the node has written
  /// @return bytes
  std::size_t take(Next next, std::span<std::uint8_t> packet, std::uint64_t now_us);

  /// Packet of a marked message that the node has taken, or one that it has refused.
  /// @param was_refused   as a bad packet
  /// @param is_own        it comes from here
  /// @param is_listening  the node puts messages of its channel together
  /// @return packets for the node that have become known by it
  std::vector<Bytes> receive(std::span<const std::uint8_t> packet, bool was_refused, bool is_own,
                             bool is_listening, std::uint64_t now_us);

  std::uint64_t received() const { return received_; }
  std::uint64_t sent() const { return sender_.sent_repairs(); }
  std::uint64_t forwarded() const { return relay_.forwarded(); }
  std::uint64_t recovered() const { return recoverer_.recovered(); }
  std::uint64_t dropped() const {
    return sender_.dropped() + relay_.dropped() + recoverer_.evicted();
  }

 private:
  bool is_copy_due(std::uint64_t now_us) const;
  bool has_copy_within(std::size_t room_bytes) const;

  RepairSender sender_;
  RepairRelay relay_;
  Recoverer recoverer_;
  std::uint64_t frame_ = 0;
  bool has_packets_ = false;     // the frame in hand
  bool is_closed_ = false;       // nothing but late copies may follow
  bool is_relays_turn_ = false;  // against the node's packets
  std::uint64_t received_ = 0;
};

}  // namespace swarmtalk::redundancy
