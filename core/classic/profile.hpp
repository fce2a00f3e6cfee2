// The profile behind core/classic/swarmtalk.h, made of the macros that a 2020 config.h defines. Its
// sensing is Meta_t, as programs know it.
#pragma once

#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/swarmtalk.hpp"

#ifndef PKT_SIZE
#define PKT_SIZE 8
#endif
#ifndef TOTAL_CHAN_NUM
#define TOTAL_CHAN_NUM 2
#endif
#ifndef MAX_PUB_PER_CHAN
#define MAX_PUB_PER_CHAN 1
#endif
#ifndef MAX_SUB_PER_CHAN
#define MAX_SUB_PER_CHAN 1
#endif
#ifndef FORWARD_BUFF_SIZE
#define FORWARD_BUFF_SIZE 10
#endif
#ifndef TIMER_BITS
#define TIMER_BITS 32
#endif
#ifndef CHAN_TYPE_MAX
#define CHAN_TYPE_MAX 15
#endif

namespace SwarmTalk {

/// What came with a message: distance of the last packet's sender, in the platform's unit, and how
/// many ticks the message waited in buffers (0 on channels without timestamps).
struct Meta_t {
  using Distance = int;
  int dist;
  int msg_delay;

  bool is_within(int limit) const { return dist < limit; }
};

struct Profile : swarmtalk::core::Classic2020 {
  using Sensing = Meta_t;
  static constexpr uint16_t kMtuBytes = PKT_SIZE;
#ifdef SWARMTALK_CLASSIC_CHECKSUM
  static constexpr swarmtalk::core::Checksum kChecksum = swarmtalk::core::Checksum::kSum8;
#endif
  static constexpr uint8_t kChannelBits = swarmtalk::core::bits_for(CHAN_TYPE_MAX);
  static constexpr uint8_t kTimestampBits = TIMER_BITS;
  static constexpr uint16_t kChannels = TOTAL_CHAN_NUM;
  static constexpr uint8_t kPublishers = MAX_PUB_PER_CHAN;
  static constexpr uint8_t kSubscribers = MAX_SUB_PER_CHAN;
  static constexpr uint16_t kForwardSlots = FORWARD_BUFF_SIZE;
  static constexpr uint16_t kFragmentSlots = TOTAL_CHAN_NUM * 20;
#ifndef __AVR__  // a config.h of a larger robot has packets of 1500 bytes
  static constexpr uint32_t kBufferBudgetBytes = UINT32_C(16) << 20;
#endif
};

/// What the macros make of a packet, as one number: equal where robots understand each other.
constexpr uint64_t kPacketFormat = static_cast<uint64_t>(PKT_SIZE) << 32 |
                                   static_cast<uint64_t>(CHAN_TYPE_MAX) << 16 |
                                   static_cast<uint64_t>(TIMER_BITS) << 1 |
                                   (Profile::kChecksum == swarmtalk::core::Checksum::kNone ? 0 : 1);

}  // namespace SwarmTalk
