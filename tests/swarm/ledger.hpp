// Who was to get which message, who heard all of its packets, who got it, how often. Filled in by a
// Scene; reads the tags of tag.hpp only.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/swarm/tag.hpp"

namespace swarmtalk::core::testing {

struct Counts {
  uint64_t messages = 0;       // published
  uint64_t packets = 0;        // of these
  uint64_t refused = 0;        // not taken: the one before had not left
  uint64_t intended = 0;       // (message, other robot) pairs
  uint64_t possible = 0;       // of these, all packets arrived, in any copies
  uint64_t delivered = 0;      // of these, at least once
  uint64_t duplicates = 0;     // delivered once more
  uint64_t own_back = 0;       // delivered to who had published it
  uint64_t spliced = 0;        // delivered, and not the packets of one message
  uint64_t transmissions = 0;  // packets
  uint64_t id_collisions = 0;
  uint64_t id_changes = 0;

  static double share(uint64_t part, uint64_t whole) {
    return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
  }
  double delivered_of_all() const { return share(delivered, intended); }
  double delivered_of_possible() const { return share(delivered, possible); }
  double possible_of_all() const { return share(possible, intended); }
  double duplicates_per_delivery() const { return share(duplicates, delivered); }
  double own_back_per_message() const { return share(own_back, messages); }
  /// Of every robot sending every packet once.
  double transmissions_of_ideal(uint32_t robots) const {
    return share(transmissions, packets * robots);
  }
  Counts& operator+=(const Counts& other) {
    messages += other.messages;
    packets += other.packets;
    refused += other.refused;
    intended += other.intended;
    possible += other.possible;
    delivered += other.delivered;
    duplicates += other.duplicates;
    own_back += other.own_back;
    spliced += other.spliced;
    transmissions += other.transmissions;
    id_collisions += other.id_collisions;
    id_changes += other.id_changes;
    return *this;
  }
};

class Ledger {
 public:
  /// Tag of the source's next message. Counts once published() says that it is.
  Tag next(uint32_t source, uint8_t packets) {
    Tag tag;
    tag.source = static_cast<uint16_t>(source);
    tag.number = static_cast<uint16_t>(books_[source].published);
    tag.packets = packets;
    return tag;
  }
  void published(const Tag& tag) {
    ++books_[tag.source].published;
    ++counts_.messages;
    counts_.packets += tag.packets;
    counts_.intended += books_.size() - 1;
  }
  void refused() { ++counts_.refused; }
  void transmitted() { ++counts_.transmissions; }

  /// A packet with `payload` physically reaches robot `to`.
  void arrived(uint32_t to, const uint8_t* payload) {
    const Tag tag = Tag::read(payload);
    if (tag.source == to || tag.source >= books_.size()) return;
    Fate& fate = fate_of(to, tag);
    const uint8_t all = static_cast<uint8_t>((1u << tag.packets) - 1);
    const uint8_t before = fate.heard;
    fate.heard = static_cast<uint8_t>(before | 1u << tag.index);
    if (before != all && fate.heard == all) ++counts_.possible;
  }
  void delivered(uint32_t to, const uint8_t* bytes, uint16_t size) {
    Tag tag;
    if (!is_whole_message(bytes, size, tag)) {
      ++counts_.spliced;
    } else if (tag.source == to) {
      ++counts_.own_back;
    } else if (fate_of(to, tag).is_delivered) {
      ++counts_.duplicates;
    } else {
      fate_of(to, tag).is_delivered = true;
      ++counts_.delivered;
    }
  }
  bool is_delivered(uint32_t to, uint32_t source, uint32_t number) const {
    const auto& fates = books_[to].fates[source];
    return number < fates.size() && fates[number].is_delivered;
  }
  bool is_possible(uint32_t to, uint32_t source, uint32_t number, uint8_t packets) const {
    const auto& fates = books_[to].fates[source];
    return number < fates.size() && fates[number].heard == (1u << packets) - 1;
  }
  uint32_t published_by(uint32_t source) const { return books_[source].published; }

  void set_robots(uint32_t robots) {
    books_.resize(robots);
    for (Book& book : books_) book.fates.resize(robots);
  }
  Counts& counts() { return counts_; }

 private:
  struct Fate {
    uint8_t heard = 0;  // one bit per packet
    bool is_delivered = false;
  };
  struct Book {
    uint32_t published = 0;
    std::vector<std::vector<Fate>> fates;  // by source and number
  };
  Fate& fate_of(uint32_t to, const Tag& tag) {
    auto& fates = books_[to].fates[tag.source];
    if (tag.number >= fates.size()) fates.resize(tag.number + 1u);
    return fates[tag.number];
  }

  std::vector<Book> books_;
  Counts counts_;
};

}  // namespace swarmtalk::core::testing
