// The oracle of the flood scenarios: a robot whose node is told, by the tag in each payload, which
// message a packet is of. It never confuses two messages and knows its own; apart from that it does
// what a node may do: the packets look the same, each is sent on once, a copy with more hops left
// improves the one that waits, a full queue sends nothing on, and its own packets and others' take
// turns. What it may remember is a setting.
#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <unordered_map>
#include <vector>

#include "tests/swarm/core_robot.hpp"
#include "tests/swarm/tag.hpp"

namespace swarmtalk::core::testing {

/// Which message is forgotten when there are as many as records.
enum class Forget {
  kLastUsed,        // the one no packet of which has come for longest
  kLastUsedClosed,  // the same, an unfinished one only if there is no other
  kOldest,          // the one whose first packet is longest ago
  kOldestClosed,
  kRefuseNew,  // none while it is young: what is new meanwhile is neither sent on nor delivered
};

struct IdealMemory {
  static constexpr uint32_t kUnlimited = UINT32_MAX;
  uint32_t forward_slots = kUnlimited;
  uint32_t records = kUnlimited;
  uint32_t fragment_slots = kUnlimited;
  Forget forget = Forget::kLastUsed;
  uint32_t young_ticks = 0;  // since its last packet; kRefuseNew only
};

/// @tparam P  the packet format
template <class P>
class IdealRobot {
 public:
  using W = Wire<P>;
  struct Settings {
    uint8_t ttl = 3;
    uint8_t channels = 1;   // unused: messages are told apart anyhow
    Ids ids = Ids::kFixed;  // unused
    IdealMemory memory;
  };

  IdealRobot(const Settings& settings, const RobotHooks& hooks, uint32_t index,
             const RobotClock& clock, uint64_t)
      : settings_(settings),
        memory_(settings.memory),
        hooks_(hooks),
        index_(index),
        clock_(clock) {}

  void restart() {
    queue_.clear();
    records_.clear();
    order_.clear();
    own_packets_ = 0;
    held_ = 0;
  }
  bool send(const uint8_t* bytes, uint16_t) {
    if (own_packets_ != 0) return false;
    own_ = Tag::read(bytes);
    own_packets_ = own_.packets;
    return true;
  }
  uint16_t pull(uint8_t* out) {
    if (own_packets_ == 0 && queue_.empty()) return 0;
    own_turn_ = !own_turn_;
    const bool is_own = queue_.empty() || (own_turn_ && own_packets_ != 0);
    if (is_own) {
      Tag tag = own_;
      tag.index = static_cast<uint8_t>(own_.packets - own_packets_);
      --own_packets_;
      const uint16_t size = build(tag, settings_.ttl, out);
      if (own_packets_ == 0) hooks_.sent(index_);
      return size;
    }
    const Waiting waiting = queue_.front();
    queue_.pop_front();
    return build(waiting.tag, waiting.ttl, out);
  }
  void receive(const uint8_t* packet, uint16_t) {
    const Tag tag = Tag::read(packet + W::kHeaderBytes);
    if (tag.source == index_) return;
    Record* const known = record_of(tag);
    if (known == nullptr) return;
    Record& record = *known;
    const auto bit = static_cast<uint8_t>(1u << tag.index);
    const uint8_t ttl = W::ttl(packet);
    if (ttl != 0) forward(record, tag, bit, static_cast<uint8_t>(ttl - 1));
    if (!record.is_done) assemble(record, tag, bit);
  }
  uint32_t id() const { return index_; }
  uint64_t id_collisions() const { return 0; }
  uint64_t id_changes() const { return 0; }

 private:
  struct Record {
    uint8_t forwarded = 0;
    uint8_t held = 0;
    bool is_done = false;  // delivered, or given up for want of memory
    uint32_t used_ticks = 0;
    std::list<uint32_t>::iterator place;
  };
  struct Waiting {
    Tag tag;
    uint8_t ttl;
  };
  using Records = std::unordered_map<uint32_t, Record>;

  static uint16_t build(const Tag& tag, uint8_t ttl, uint8_t* out) {
    typename W::Header header = {};
    header.node = static_cast<typename W::NodeId>(tag.source + 1);
    header.message = static_cast<typename W::MessageNumber>(tag.number + 1u);
    header.sequence = tag.index;
    header.end = tag.index + 1 == tag.packets;
    header.ttl = ttl;
    W::encode(header, out);
    tag.write(out + W::kHeaderBytes);
    return W::seal(out, static_cast<typename W::PacketSize>(W::kHeaderBytes + Tag::kBytes));
  }
  static uint32_t packets_in(uint8_t mask) {
    uint32_t count = 0;
    for (; mask != 0; mask = static_cast<uint8_t>(mask & (mask - 1))) ++count;
    return count;
  }

  /// @return null if there is none and no place for one
  Record* record_of(const Tag& tag) {
    const uint32_t now = clock_.ticks();
    const auto found = records_.find(tag.message());
    if (found != records_.end()) {
      if (is_by_use()) order_.splice(order_.end(), order_, found->second.place);
      found->second.used_ticks = now;
      return &found->second;
    }
    if (records_.size() >= memory_.records && !forget_one(now)) return nullptr;
    Record& record = records_[tag.message()];
    record.used_ticks = now;
    record.place = order_.insert(order_.end(), tag.message());
    return &record;
  }
  bool is_by_use() const {
    return memory_.forget != Forget::kOldest && memory_.forget != Forget::kOldestClosed;
  }
  bool forget_one(uint32_t now) {
    auto victim = order_.begin();
    if (memory_.forget == Forget::kLastUsedClosed || memory_.forget == Forget::kOldestClosed) {
      while (victim != order_.end() && !records_[*victim].is_done) ++victim;
      if (victim == order_.end()) victim = order_.begin();
    }
    const Record& record = records_[*victim];
    if (memory_.forget == Forget::kRefuseNew && now - record.used_ticks <= memory_.young_ticks) {
      return false;
    }
    held_ -= packets_in(record.held);
    records_.erase(*victim);
    order_.erase(victim);
    return true;
  }
  void forward(Record& record, const Tag& tag, uint8_t bit, uint8_t ttl) {
    if ((record.forwarded & bit) != 0) {
      for (Waiting& waiting : queue_) {
        if (waiting.tag.message() == tag.message() && waiting.tag.index == tag.index) {
          if (ttl > waiting.ttl) waiting.ttl = ttl;
          return;
        }
      }
      return;
    }
    if (queue_.size() >= memory_.forward_slots) return;
    queue_.push_back({tag, ttl});
    record.forwarded = static_cast<uint8_t>(record.forwarded | bit);
  }
  /// The last packet of a message needs no slot: it is whole at once.
  void assemble(Record& record, const Tag& tag, uint8_t bit) {
    if ((record.held & bit) != 0) return;
    const uint32_t so_far = packets_in(record.held);
    if (so_far + 1 == tag.packets) {
      release(record);
      uint8_t bytes[Tag::kMaxPackets * Tag::kBytes];
      hooks_.message(index_, bytes, write_message(tag, bytes));
      return;
    }
    if (held_ >= memory_.fragment_slots && !make_room(record, so_far)) return;
    record.held = static_cast<uint8_t>(record.held | bit);
    ++held_;
  }
  void release(Record& record) {
    held_ -= packets_in(record.held);
    record.held = 0;
    record.is_done = true;
  }
  /// Gives up the message that has come least far, this one included.
  bool make_room(Record& wanted, uint32_t so_far) {
    Record* least = &wanted;
    uint32_t fewest = so_far + 1;
    for (const uint32_t message : order_) {
      Record& record = records_[message];
      const uint32_t held = packets_in(record.held);
      if (held == 0 || held >= fewest || &record == &wanted) continue;
      least = &record;
      fewest = held;
    }
    release(*least);
    return least != &wanted;
  }

  Settings settings_;
  IdealMemory memory_;
  const RobotHooks& hooks_;
  uint32_t index_;
  const RobotClock& clock_;
  Tag own_;
  uint8_t own_packets_ = 0;  // still to be sent
  bool own_turn_ = false;
  std::deque<Waiting> queue_;
  Records records_;
  std::list<uint32_t> order_;  // of messages, the next to be forgotten first
  uint32_t held_ = 0;          // packets of unfinished messages
};

/// Memory like profile P's, told identities.
template <class P>
IdealMemory memory_of(Forget forget) {
  IdealMemory memory;
  memory.forward_slots = P::kForwardSlots;
  memory.records = P::kRecords;
  memory.fragment_slots = P::kFragmentSlots;
  memory.forget = forget;
  return memory;
}
/// The same under all policies.
template <class P>
std::vector<IdealMemory> memories_of() {
  std::vector<IdealMemory> memories;
  for (Forget forget :
       {Forget::kLastUsed, Forget::kLastUsedClosed, Forget::kOldest, Forget::kOldestClosed}) {
    memories.push_back(memory_of<P>(forget));
  }
  for (uint32_t young_ticks : {32u, 64u, 128u, 256u, 512u}) {
    memories.push_back(memory_of<P>(Forget::kRefuseNew));
    memories.back().young_ticks = young_ticks;
  }
  return memories;
}
/// Unlimited but for profile P's queue.
template <class P>
IdealMemory unlimited_memory() {
  IdealMemory memory;
  memory.forward_slots = P::kForwardSlots;
  return memory;
}

}  // namespace swarmtalk::core::testing
