// Recoverer: what has come of messages with parity packets, until they are whole. As soon as the
// packets and parity packets of a message are as many as it has packets, it works out the missing
// ones. Its caller's node puts the message together, as if they had come. Reads no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "redundancy/erasure_code.hpp"
#include "redundancy/wifi_packet.hpp"

namespace swarmtalk::redundancy {

class Recoverer {
 public:
  /// As a node waits for the rest of a message.
  static constexpr std::uint64_t kLifeUs = core::Wifi::kAssemblyTicks;
  static constexpr std::size_t kMostMessages = 128;
  /// Of packets held; beyond it the message that has waited longest is given up here. (Its node may
  /// put it together all the same.)
  static constexpr std::size_t kMostBytes = std::size_t{1} << 19;

  /// A packet has come whose message has parity packets, or a parity packet.
  /// @param packet  marked, and sound: the node has taken it, or is_parity()
  /// @return the packets that this makes known, in order
  std::vector<Bytes> add(std::span<const std::uint8_t> packet, const Header& header,
                         std::uint64_t now_us);

  std::uint64_t recovered() const { return recovered_; }
  /// Messages that this had no room for while they were not whole.
  std::uint64_t evicted() const { return evicted_; }
  std::size_t held_bytes() const { return held_bytes_; }

 private:
  struct Message {
    MessageName name;
    std::uint16_t size = 0;
    bool has_delay = false;
    bool is_done = false;
    std::uint64_t heard_us = 0;
    unsigned held = 0;
    std::vector<Bytes> sources;
    std::vector<Parity> parities;
    Bytes head;  // of the parity packet that came last: its header
    Bytes tail;  // ... and its timestamp
    std::uint64_t tail_us = 0;
  };

  Message* message_of(const Header& header, std::uint64_t now_us);
  void make_room(std::uint64_t now_us);
  void drop_packets(Message& message);
  bool hold(Message& message, std::span<const std::uint8_t> packet, const Header& header,
            std::uint64_t now_us);
  std::vector<Bytes> complete(Message& message, std::uint64_t now_us);

  std::vector<Message> messages_;
  std::size_t held_bytes_ = 0;
  std::uint64_t recovered_ = 0;
  std::uint64_t evicted_ = 0;
};

}  // namespace swarmtalk::redundancy
