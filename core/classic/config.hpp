// The macros of a 2020 config.h, with the values of the release for Kilobots where one is missing.
// All that decide what is on the air are honoured, and so are those that bound memory; a value that
// cannot be is refused here by its name. Included by profile.hpp only.
#pragma once

#include <stdint.h>

#include "swarmtalk/types.hpp"

// What is on the air.
#ifndef PKT_SIZE
#define PKT_SIZE 8
#endif
#ifndef NODE_ID_BITS
#define NODE_ID_BITS 8
#endif
#ifndef MSG_ID_BITS
#define MSG_ID_BITS 4
#endif
#ifndef SEQ_NUM_BITS
#define SEQ_NUM_BITS 3
#endif
#ifndef TTL_BITS
#define TTL_BITS 4
#endif
#ifndef TIMER_BITS
#define TIMER_BITS 32
#endif
// Channels: their bits, or the largest number, from which the bits follow.
#if !defined(CHAN_TYPE_BITS) && !defined(CHAN_TYPE_MAX)
#define CHAN_TYPE_BITS 4
#endif
#ifndef CHAN_TYPE_MAX
#define CHAN_TYPE_MAX ((INT32_C(1) << (CHAN_TYPE_BITS & 31)) - 1)
#elif !defined(CHAN_TYPE_BITS)
#define CHAN_TYPE_BITS (swarmtalk::core::bits_for(CHAN_TYPE_MAX))
#endif
// The checksum; SWARMTALK_CLASSIC_CHECKSUM says the same for programs of the paper.
#ifdef SWARMTALK_CLASSIC_CHECKSUM
#ifndef WITH_CRC
#define WITH_CRC true
#elif !WITH_CRC
#error "WITH_CRC is false, and SWARMTALK_CLASSIC_CHECKSUM asks for a checksum: leave one out"
#endif
#endif
#ifndef WITH_CRC
#define WITH_CRC false
#endif

// Memory.
#ifndef TOTAL_CHAN_NUM
#define TOTAL_CHAN_NUM 2
#endif
#ifndef BUFF_SIZE_PER_CHAN
#define BUFF_SIZE_PER_CHAN 20
#endif
#ifndef FORWARD_BUFF_SIZE
#define FORWARD_BUFF_SIZE 10
#endif
#ifndef MAX_SUB_PER_CHAN
#define MAX_SUB_PER_CHAN 1
#endif
#ifndef MAX_PUB_PER_CHAN
#define MAX_PUB_PER_CHAN 1
#endif
#ifndef CACHE_SIZE
#define CACHE_SIZE 5
#endif

namespace SwarmTalk {

/// A macro's value, whatever its type, to be compared.
constexpr int64_t value_of(int64_t value) {
  return value;
}
constexpr bool is_between(int64_t low, int64_t value, int64_t high) {
  return low <= value && value <= high;
}

constexpr int64_t kHeaderBytes =
    (value_of(NODE_ID_BITS) + MSG_ID_BITS + SEQ_NUM_BITS + 1 + CHAN_TYPE_BITS + TTL_BITS + 7) / 8;
constexpr int64_t kPayloadBytes = value_of(PKT_SIZE) - kHeaderBytes - (WITH_CRC ? 1 : 0);
/// Without it there are no time channels: new_channel() refuses them.
constexpr bool kTimestampLeavesRoom = kPayloadBytes > (value_of(TIMER_BITS) + 7) / 8;

static_assert(is_between(1, NODE_ID_BITS, 16), "NODE_ID_BITS: node ids have 1 to 16 bits");
static_assert(is_between(1, MSG_ID_BITS, 32), "MSG_ID_BITS: message numbers have 1 to 32 bits");
static_assert(is_between(0, SEQ_NUM_BITS, 5),
              "SEQ_NUM_BITS: sequence numbers have 0 to 5 bits, for up to 32 packets a message");
static_assert(is_between(1, CHAN_TYPE_BITS, 16), "CHAN_TYPE_BITS: channels have 1 to 16 bits");
static_assert(is_between(1, CHAN_TYPE_MAX, 65535), "CHAN_TYPE_MAX: channels go up to 1 to 65535");
static_assert(swarmtalk::core::bits_for(static_cast<uint32_t>(CHAN_TYPE_MAX)) == CHAN_TYPE_BITS,
              "CHAN_TYPE_MAX and CHAN_TYPE_BITS contradict each other: leave one out");
static_assert(is_between(0, TTL_BITS, 8), "TTL_BITS: the TTL has 0 to 8 bits");
static_assert(is_between(0, TIMER_BITS, 32), "TIMER_BITS: a timestamp has 0 to 32 bits");
static_assert(is_between(1, PKT_SIZE, 65535), "PKT_SIZE: a packet has 1 to 65535 bytes");
static_assert(kPayloadBytes >= 1, "PKT_SIZE: header and checksum leave nothing for a message");
static_assert(kPayloadBytes * (INT64_C(1) << (SEQ_NUM_BITS & 31)) <= 65535,
              "PKT_SIZE: the packets that SEQ_NUM_BITS counts hold more than 65535 bytes");
static_assert(is_between(1, TOTAL_CHAN_NUM, 2000), "TOTAL_CHAN_NUM: a node has 1 to 2000 channels");
static_assert(BUFF_SIZE_PER_CHAN >= 1 &&
                  is_between(1, value_of(TOTAL_CHAN_NUM) * BUFF_SIZE_PER_CHAN, 65535),
              "BUFF_SIZE_PER_CHAN: all channels together hold 1 to 65535 packets");
static_assert(is_between(1, FORWARD_BUFF_SIZE, 65535),
              "FORWARD_BUFF_SIZE: 1 to 65535 packets wait to be sent on");
static_assert(is_between(1, MAX_SUB_PER_CHAN, 255), "MAX_SUB_PER_CHAN: 1 to 255 subscribers");
static_assert(is_between(1, MAX_PUB_PER_CHAN, 255), "MAX_PUB_PER_CHAN: 1 to 255 publishers");
static_assert(is_between(0, CACHE_SIZE, 65535), "CACHE_SIZE: 0 to 65535 messages are remembered");

}  // namespace SwarmTalk
