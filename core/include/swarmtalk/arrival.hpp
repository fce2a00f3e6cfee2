// A received packet on its way through a node: what it holds of which message, once lengths and
// numbers have been checked against each other.
#pragma once

#include <stdint.h>

#include "swarmtalk/channel.hpp"
#include "swarmtalk/reassembler.hpp"
#include "swarmtalk/record.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

template <class P>
struct Arrival : Fragment<P> {
  using W = Wire<P>;
  using PacketSize = typename W::PacketSize;
  using Entry = Record<P>;

  RecordKey<P> key;
  PacketSize size_bytes;  // of the packet
  Channel<P>* to;         // null: not registered here

  const uint8_t* packet() const { return this->payload - W::kHeaderBytes; }
  /// The whole message.
  bool is_whole() const { return this->end && this->sequence == 0; }

  /// From a packet that Wire<P>::check() has passed, all but its fragment.
  void read_header(const uint8_t* packet, uint16_t packet_bytes) {
    size_bytes = static_cast<PacketSize>(packet_bytes);
    W::decode(packet, *this);
    key = RecordKey<P>(packet);
  }
  /// What it holds of its message, once `to` is known. @return false if the packet contradicts
  /// itself
  bool read_fragment(const uint8_t* packet);

  /// Of a flooded message's packet: whether its sender itself has sent it (nothing is off its TTL
  /// yet), or a forwarder, or nobody knows: flags of a record.
  uint8_t kind() const {
    uint8_t sent_ttl = this->ttl;
    if (P::kHopsBits != 0) {
      sent_ttl = static_cast<uint8_t>(sent_ttl + (this->hops != 0 ? 1 : 0));
    } else if (!P::kHopsFromTtl || to == nullptr || to->ttl() < this->ttl) {
      return Entry::kFlood;
    } else {
      sent_ttl = to->ttl();
    }
    return sent_ttl == this->ttl ? Entry::kFlood | Entry::kDirect : Entry::kFlood | Entry::kRelayed;
  }

 private:
  bool fits_size(bool timestamped, PacketSize body_bytes) const;
};

template <class P>
bool Arrival<P>::read_fragment(const uint8_t* packet) {
  PacketSize body_bytes =
      P::kPadded ? W::kBodyBytes
                 : static_cast<PacketSize>(size_bytes - W::kHeaderBytes - W::kChecksumBytes);
  const uint8_t* body = packet + W::kHeaderBytes;
  this->payload = body;
  this->delay_ticks = 0;
  if (this->has_delay) {
    if (body_bytes < W::kTimestampBytes) return false;
    this->delay_ticks = W::timestamp(body, body_bytes);
    body_bytes = static_cast<PacketSize>(body_bytes - W::kTimestampBytes);
  }
  this->payload_bytes = body_bytes;
  if (W::kMaxPackets < (UINT32_C(1) << P::kSequenceBits) && this->sequence >= W::kMaxPackets) {
    return false;
  }
  this->bit = W::bit_of(this->sequence);
  // Where nothing marks timestamps, who does not have the channel cannot know: it only forwards.
  const bool is_of_either_kind = !W::kMarksTimestamps && P::kTimestampBits != 0 && to == nullptr;
  if (P::kSizeBits != 0) {
    return fits_size(this->has_delay, body_bytes) ||
           (is_of_either_kind && body_bytes >= W::kTimestampBytes &&
            fits_size(true, static_cast<PacketSize>(body_bytes - W::kTimestampBytes)));
  }
  if (W::kLimitsPlaces && !is_of_either_kind &&
      !W::is_within_message(this->sequence, this->end, this->has_delay, body_bytes)) {
    return false;
  }
  if (P::kPadded) return true;
  return this->end ? this->sequence == 0 || body_bytes != 0 : body_bytes == this->payload_max();
}

template <class P>
inline bool Arrival<P>::fits_size(bool timestamped, PacketSize body_bytes) const {
  const uint16_t limit = timestamped ? W::kTimedMessageBytes : W::kMessageBytes;
  if (this->size > limit) return false;
  const PacketSize payload_max =
      static_cast<PacketSize>(timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes);
  const uint16_t packets = W::packets_for(this->size, payload_max);
  if (this->end != (this->sequence + 1u == packets) || this->sequence >= packets) return false;
  return body_bytes == (this->end ? this->size - this->sequence * payload_max : payload_max);
}

}  // namespace core
}  // namespace swarmtalk
