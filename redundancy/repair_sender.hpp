// RepairSender: the repair packets of a station's own messages. A message of several packets gets
// parity packets, made while its packets leave. A message of one packet gets late copies of it,
// which ride in a later frame that leaves anyway; one that finds none in kCopyWaitUs goes alone.
// Reads no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "redundancy/erasure_code.hpp"

namespace swarmtalk::redundancy {

class RepairSender {
 public:
  /// docs/decisions/0044: programs send each 120 to 180 ms.
  static constexpr std::uint64_t kCopyWaitUs = 300'000;
  static constexpr std::size_t kMostCopies = 64;
  static constexpr std::size_t kMostParities = 48;

  /// @param copy_wait_us  a late copy that finds no frame to ride in leaves alone after so long
  explicit RepairSender(std::uint64_t copy_wait_us = kCopyWaitUs) : copy_wait_us_(copy_wait_us) {}

  /// Nothing was asked for.
  bool is_idle() const { return protected_.empty() && parities_.empty() && copies_.empty(); }

  /// The message that has been handed to the node gets so many. @param repairs  1 to kMostRepairs
  void protect(std::uint16_t channel, std::uint32_t number, unsigned repairs);
  /// What the channel's messages have got is kept, the rest of them gets nothing.
  void forget(std::uint16_t channel);
  /// The channel's last message is about to leave once more: its late copies come after that.
  void repeats(std::uint16_t channel);

  /// A packet of ours leaves in this frame. Marks it if its message has parity packets.
  void sent(std::span<std::uint8_t> packet, std::uint64_t frame, std::uint64_t now_us);

  bool has_parity() const { return !parities_.empty(); }
  std::size_t parity_bytes() const { return parities_.front().packet.size(); }
  /// @return bytes written to `out`. @pre has_parity(), and it fits
  std::size_t take_parity(std::span<std::uint8_t> out, std::uint64_t now_us);

  /// The first late copy that may leave in this frame, none: there is none.
  std::optional<std::size_t> copy_bytes(std::uint64_t frame) const;
  /// When the next one leaves alone; none: there is none.
  std::optional<std::uint64_t> next_due_us() const;
  /// @pre copy_bytes(frame), and it fits
  std::size_t take_copy(std::span<std::uint8_t> out, std::uint64_t frame, std::uint64_t now_us);

  std::uint64_t sent_repairs() const { return sent_; }
  /// Repair packets that never left: others came faster.
  std::uint64_t dropped() const { return dropped_; }

 private:
  struct Waiting {
    Bytes packet;
    std::uint64_t since_us = 0;
  };
  struct Copy : Waiting {
    std::uint64_t due_us = 0;
    std::uint64_t last_frame = 0;  // in which the message, or a copy of it, has left
    unsigned left = 0;
    bool is_held = false;  // until the whole message has left once more

    bool is_of(std::uint16_t channel) const;
    bool may_leave(std::uint64_t frame) const { return !is_held && last_frame < frame; }
  };
  struct Protected {
    std::uint32_t number = 0;
    unsigned repairs = 0;
    bool is_made = false;
    std::vector<Bytes> sums;  // the parity packets' payloads, of those that have left
  };

  void keep_copy(Copy copy);
  void release_copies(std::uint16_t channel, std::uint64_t frame, std::uint64_t now_us);
  void make_parities(Protected& message, std::span<const std::uint8_t> last, std::uint64_t now_us);

  std::uint64_t copy_wait_us_;
  std::map<std::uint16_t, Protected> protected_;  // by channel
  std::deque<Waiting> parities_;
  std::deque<Copy> copies_;  // by when they are due
  std::uint64_t sent_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace swarmtalk::redundancy
