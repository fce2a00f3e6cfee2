// The profile behind core/classic/swarmtalk.h, made of the macros of a 2020 config.h. Its sensing
// is Meta_t, as programs know it.
#pragma once

#include "core/classic/config.hpp"
#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/swarmtalk.hpp"

// A config.h also defines `typedef struct Meta {...} Meta_t;`, with what its platform measures.
struct Meta;

namespace SwarmTalk {

/// What came with a message, where no config.h says otherwise: distance of the last packet's
/// sender, in the platform's unit, and how many ticks the message waited in buffers (0 on channels
/// without timestamps).
struct Default_meta {
  int dist;
  int msg_delay;
};
template <class Configured, class = decltype(sizeof(0))>
struct Meta_of {
  using Type = Default_meta;
};
template <class Configured>
struct Meta_of<Configured, decltype(sizeof(Configured::dist) + sizeof(Configured::msg_delay))> {
  using Type = Configured;
};
using swarmtalk_meta_t = Meta_of<::Meta>::Type;

}  // namespace SwarmTalk

// A name of ours, because the one of a config.h would stand beside it.
#define Meta_t swarmtalk_meta_t

namespace SwarmTalk {

/// Meta_t as the core looks at it.
struct Meta_sensing {
  using Distance = int;
  Meta_t meta;

  bool is_within(int limit) const { return meta.dist < limit; }
};

constexpr uint16_t larger(int32_t a, int32_t b) {
  return static_cast<uint16_t>(a < b ? b : a);
}

struct Profile : swarmtalk::core::Classic2020 {
  using Sensing = Meta_sensing;
  static constexpr uint16_t kMtuBytes = PKT_SIZE;
  static constexpr uint8_t kNodeBits = NODE_ID_BITS;
  static constexpr uint8_t kMessageBits = MSG_ID_BITS;
  static constexpr uint8_t kSequenceBits = SEQ_NUM_BITS;
  static constexpr uint8_t kChannelBits = CHAN_TYPE_BITS;
  static constexpr uint8_t kTtlBits = TTL_BITS;
  static constexpr uint8_t kTimestampBits = kTimestampLeavesRoom ? TIMER_BITS : 0;
  static constexpr swarmtalk::core::Checksum kChecksum =
      WITH_CRC ? swarmtalk::core::Checksum::kSum8 : swarmtalk::core::Checksum::kNone;

  static constexpr uint16_t kChannels = TOTAL_CHAN_NUM;
  static constexpr uint8_t kPublishers = MAX_PUB_PER_CHAN;
  static constexpr uint8_t kSubscribers = MAX_SUB_PER_CHAN;
  static constexpr uint16_t kForwardSlots = FORWARD_BUFF_SIZE;
  static constexpr uint16_t kFragmentSlots = TOTAL_CHAN_NUM * BUFF_SIZE_PER_CHAN;
#ifdef __AVR__
  static constexpr uint16_t kRecords = larger(24, CACHE_SIZE);
#else  // a config.h of a larger robot has packets of 1500 bytes, and buffers for 300 of them
  static constexpr uint16_t kRecords =
      larger(larger(24, CACHE_SIZE), TOTAL_CHAN_NUM* BUFF_SIZE_PER_CHAN / 2);
  static constexpr uint32_t kBufferBudgetBytes = UINT32_C(1) << 28;
#endif
};

/// What the macros make of a packet, as one number: equal where robots understand each other, and
/// name their channels alike.
constexpr uint64_t kPacketFormat =
    static_cast<uint64_t>(PKT_SIZE) << 46 | static_cast<uint64_t>(NODE_ID_BITS) << 41 |
    static_cast<uint64_t>(MSG_ID_BITS) << 35 | static_cast<uint64_t>(SEQ_NUM_BITS) << 32 |
    static_cast<uint64_t>(CHAN_TYPE_BITS) << 27 | static_cast<uint64_t>(TTL_BITS) << 23 |
    static_cast<uint64_t>(TIMER_BITS) << 17 | static_cast<uint64_t>(CHAN_TYPE_MAX) << 1 |
    (WITH_CRC ? 1 : 0);
/// What they make of a node's memory.
constexpr uint64_t kMemoryFormat = static_cast<uint64_t>(Profile::kRecords) << 48 |
                                   static_cast<uint64_t>(Profile::kFragmentSlots) << 32 |
                                   static_cast<uint64_t>(FORWARD_BUFF_SIZE) << 16 |
                                   static_cast<uint64_t>(MAX_SUB_PER_CHAN) << 8 |
                                   static_cast<uint64_t>(MAX_PUB_PER_CHAN);

}  // namespace SwarmTalk
