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
  using MessageNumber = typename W::MessageNumber;
  using Ticks = typename W::WaitTicks;
  using Size = typename W::MessageSize;
  using PacketSize = typename W::PacketSize;

  /// Empty. (A function, so that a channel which is not used costs no memory that is touched.)
  /// @param header  channel, message (the last number used) and has_delay of all packets to come
  void reset(const Header& header) {
    W::encode(header, header_);
    is_busy_ = false;
  }
  bool is_busy() const { return is_busy_; }
  /// Number of the message here, or of the last one.
  MessageNumber number() const { return W::MessageField::get(header_); }

  /// Takes a copy of a message, under the next number. REQUIRES !is_busy().
  /// @param size  0..kMessageBytes, or kTimedMessageBytes if timestamped
  void load(const uint8_t* bytes, uint16_t size, uint8_t ttl, bool crossed_gateway, Ticks now) {
    if (size != 0) memcpy(bytes_, bytes, size);
    size_ = static_cast<Size>(size);
    W::MessageField::put(header_, static_cast<MessageNumber>(number() + 1u));
    W::TtlField::put(header_, ttl);
    W::SizeField::put(header_, static_cast<typename W::SizeField::Value>(size));
    W::GatewayField::put(header_, crossed_gateway ? 1 : 0);
    since_ = now;
    rewind();
  }

  /// Nothing of the message has been sent. REQUIRES is_busy()
  bool is_untouched() const { return at_ == 0; }
  /// The sender of this message. To be told before its first packet.
  void set_sender(typename W::NodeId node, typename W::Epoch epoch) {
    W::NodeField::put(header_, node);
    W::EpochField::put(header_, epoch);
  }

  /// The message in hand was handed over `waited` ticks ago. REQUIRES is_busy()
  void backdate(Ticks waited) { since_ = static_cast<Ticks>(since_ - waited); }

  /// Begins the message again that has left last. REQUIRES that there was one, !is_busy()
  void rewind() {
    at_ = 0;
    W::SequenceField::put(header_, 0);
    W::EndField::put(header_, 0);
    is_busy_ = true;
  }

  /// The next message gets the number after `number`. REQUIRES !is_busy()
  void continue_after(MessageNumber number) { W::MessageField::put(header_, number); }

  /// Bytes that next() will write. REQUIRES is_busy()
  PacketSize next_bytes(bool timestamped) const {
    if (P::kPadded) return W::kMtuBytes;
    const PacketSize payload_max =
        static_cast<PacketSize>(timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes);
    const Size left = static_cast<Size>(size_ - at_);
    const PacketSize payload = left <= payload_max ? static_cast<PacketSize>(left) : payload_max;
    return static_cast<PacketSize>(W::kHeaderBytes + payload +
                                   (timestamped ? W::kTimestampBytes : 0) + W::kChecksumBytes);
  }

  /// Writes the next packet.
  /// @param timestamped  as in reset()
  /// @return bytes written to `out`; is_busy() is false after the last packet
  PacketSize next(bool timestamped, Ticks now, uint8_t* out) {
    PacketSize payload =
        static_cast<PacketSize>(timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes);
    const Size left = static_cast<Size>(size_ - at_);
    if (left <= payload) {
      payload = static_cast<PacketSize>(left);
      W::EndField::put(header_, 1);
      is_busy_ = false;
    }
    memcpy(out, header_, W::kHeaderBytes);
    uint8_t* const body = out + W::kHeaderBytes;
    if (P::kPadded) memset(body, 0, W::kBodyBytes);
    memcpy(body, bytes_ + at_, payload);
    PacketSize body_bytes = W::kBodyBytes;
    if (!P::kPadded) {
      body_bytes = static_cast<PacketSize>(payload + (timestamped ? W::kTimestampBytes : 0));
    }
    if (timestamped) {
      W::set_timestamp(body, body_bytes, W::later(0, static_cast<Ticks>(now - since_)));
    }
    at_ = static_cast<Size>(at_ + payload);
    W::SequenceField::put(header_,
                          static_cast<typename W::Sequence>(W::SequenceField::get(header_) + 1u));
    return W::seal(out, static_cast<PacketSize>(W::kHeaderBytes + body_bytes));
  }

 private:
  Size size_;
  Size at_;      // bytes sent
  Ticks since_;  // when the message was handed over
  bool is_busy_;
  uint8_t header_[W::kHeaderBytes];  // of the next packet
  uint8_t bytes_[W::kMessageBytes];
};

}  // namespace core
}  // namespace swarmtalk
