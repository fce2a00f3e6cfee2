// Sending: what becomes of messages that a publisher sends faster than they leave, and how often
// each is sent. A value; by default a few messages wait:
//   Sending::newest(8).repeated(3)
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace swarmtalk {

/// What becomes of messages that are sent faster than they leave.
struct Sending {
  static constexpr std::uint32_t kDefaultQueue = 16;

  std::uint32_t queue = kDefaultQueue;  // messages that wait in the daemon behind the one in flight
  bool drop_oldest = false;             // when the queue is full; else send() answers kBusy
  std::uint32_t copies = 1;             // each message is sent that many times and delivered once
  std::optional<std::chrono::milliseconds> copy_interval =
      std::nullopt;  // unset: the daemon's default
  /// For redundancy: as many as the loss demands that is measured around the robot.
  static constexpr std::uint32_t kAutoRedundancy = UINT32_MAX;
  std::uint32_t redundancy = 0;  // repair packets of each message, at most 12

  /// The paper's rule: nothing waits, and send() answers kBusy until the message before has left.
  /// For state of which only the newest counts.
  static Sending one_at_a_time() { return queued(0); }
  /// Up to `count` messages wait; then send() answers kBusy.
  static Sending queued(std::uint32_t count) {
    Sending sending;
    sending.queue = count;
    return sending;
  }
  /// Up to `count` messages wait; for one more the oldest is dropped, and its `sent` told kDropped.
  static Sending newest(std::uint32_t count) {
    Sending sending = queued(count);
    sending.drop_oldest = true;
    return sending;
  }
  /// For what must not be missed: each message is sent `times` times, and takes that much longer. A
  /// receiver of several copies delivers one.
  Sending repeated(std::uint32_t times,
                   std::optional<std::chrono::milliseconds> interval = std::nullopt) const {
    Sending sending = *this;
    sending.copies = times;
    sending.copy_interval = interval;
    return sending;
  }
  /// Each message arrives though any `repairs` of its packets are lost: so many more leave behind
  /// it. Those of a message of one packet ride in frames that leave anyway. See docs/redundancy.md.
  Sending redundant(std::uint32_t repairs = kAutoRedundancy) const {
    Sending sending = *this;
    sending.redundancy = repairs;
    return sending;
  }
};

}  // namespace swarmtalk
