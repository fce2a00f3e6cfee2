// The send buffer of a channel: keeps one message until its last packet has been pulled, and cuts
// it into packets. Owned by the channel; filled by publishers, emptied by the node.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

template <class P>
class Fragmenter {
 public:
  using W = Wire<P>;
  using Header = typename W::Header;
  using Ticks = UintFor<P::kClockBits>;
  using Size = typename W::MessageSize;
  using PacketSize = typename W::PacketSize;

  /// Empty. (A function, so that a channel which is not used costs no memory that is touched.)
  void reset() { is_busy_ = false; }
  bool is_busy() const { return is_busy_; }

  /// Takes a copy of a message. REQUIRES !is_busy().
  /// @param size  0..kMessageBytes, or kTimedMessageBytes if timestamped
  void load(const uint8_t* bytes, uint16_t size, uint8_t ttl, bool crossed_gateway, Ticks now) {
    if (size != 0) memcpy(bytes_, bytes, size);
    size_ = static_cast<Size>(size);
    ttl_ = ttl & W::kTtlMax;
    crossed_gateway_ = crossed_gateway;
    since_ = now;
    sequence_ = 0;
    is_busy_ = true;
  }

  typename W::Sequence sequence() const { return sequence_; }
  uint8_t ttl() const { return ttl_; }

  /// Writes the next packet.
  /// @param header  node, message, channel, epoch and timestamped are the caller's; the rest is
  ///                filled in here
  /// @return bytes written to `out`; is_busy() is false after the last packet
  PacketSize next(Header& header, Ticks now, uint8_t* out) {
    const PacketSize payload_max = header.timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes;
    const Size at = static_cast<Size>(sequence_ * payload_max);
    const Size left = static_cast<Size>(size_ - at);
    header.end = left <= payload_max;
    const PacketSize payload = header.end ? static_cast<PacketSize>(left) : payload_max;
    header.sequence = sequence_;
    header.ttl = ttl_;
    header.hops = 0;
    header.size = static_cast<decltype(header.size)>(size_);
    header.crossed_gateway = crossed_gateway_;
    W::encode(header, out);
    uint8_t* body = out + W::kHeaderBytes;
    memcpy(body, bytes_ + at, payload);
    PacketSize body_bytes = payload;
    if (P::kPadded) {
      memset(body + payload, 0, static_cast<size_t>(W::kBodyBytes - payload));
      body_bytes = W::kBodyBytes;
    } else if (header.timestamped) {
      body_bytes = static_cast<PacketSize>(payload + W::kTimestampBytes);
    }
    if (header.timestamped) {
      W::set_timestamp(body, body_bytes, W::later(0, static_cast<Ticks>(now - since_)));
    }
    ++sequence_;
    is_busy_ = !header.end;
    return W::seal(out, static_cast<PacketSize>(W::kHeaderBytes + body_bytes));
  }

 private:
  uint8_t bytes_[W::kMessageBytes];
  Size size_;
  typename W::Sequence sequence_;  // of the next packet
  uint8_t ttl_ : P::kTtlBits == 0 ? 1 : P::kTtlBits;
  bool crossed_gateway_ : 1;
  bool is_busy_ : 1;
  Ticks since_;  // when the message was handed over
};

}  // namespace core
}  // namespace swarmtalk
