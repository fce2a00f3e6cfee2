// What every packet's payload tells in the flood scenarios: who published the message, which of its
// messages it is, which packet of how many. So a splice shows, and an ideal node can be told what a
// node under test has to find out. Fits the five payload bytes of a Kilobot's packet.
#pragma once

#include <cstdint>

namespace swarmtalk::core::testing {

struct Tag {
  static constexpr uint16_t kBytes = 5;
  static constexpr uint8_t kMaxPackets = 8;

  uint16_t source = 0;
  uint16_t number = 0;  // of the source's messages, all its channels and starts together
  uint8_t index = 0;    // of the packet in its message
  uint8_t packets = 1;  // 1..kMaxPackets

  void write(uint8_t* to) const {
    to[0] = static_cast<uint8_t>(source >> 8);
    to[1] = static_cast<uint8_t>(source);
    to[2] = static_cast<uint8_t>(number >> 8);
    to[3] = static_cast<uint8_t>(number);
    to[4] = static_cast<uint8_t>(index << 3 | (packets - 1));
  }
  static Tag read(const uint8_t* from) {
    Tag tag;
    tag.source = static_cast<uint16_t>(from[0] << 8 | from[1]);
    tag.number = static_cast<uint16_t>(from[2] << 8 | from[3]);
    tag.index = static_cast<uint8_t>(from[4] >> 3 & 7);
    tag.packets = static_cast<uint8_t>((from[4] & 7) + 1);
    return tag;
  }
  bool is_of_message(const Tag& other) const {
    return source == other.source && number == other.number && packets == other.packets;
  }
  uint32_t message() const { return static_cast<uint32_t>(source) << 16 | number; }
};

/// Writes all packets' tags of one message. @return its bytes
inline uint16_t write_message(Tag tag, uint8_t* to) {
  for (tag.index = 0; tag.index < tag.packets; ++tag.index) tag.write(to + tag.index * Tag::kBytes);
  return static_cast<uint16_t>(tag.packets * Tag::kBytes);
}

/// Whether `bytes` are all packets of one message, in order. @param tag  gets the first packet's
inline bool is_whole_message(const uint8_t* bytes, uint16_t size, Tag& tag) {
  tag = Tag::read(bytes);
  if (size != tag.packets * Tag::kBytes) return false;
  for (uint8_t i = 0; i < tag.packets; ++i) {
    const Tag at = Tag::read(bytes + i * Tag::kBytes);
    if (!at.is_of_message(tag) || at.index != i) return false;
  }
  return true;
}

}  // namespace swarmtalk::core::testing
