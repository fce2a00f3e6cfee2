// A channel: its number, its TTL, its send buffer and the publishers and subscribers of this robot.
// Made by Swarmtalk::new_channel, lives in the node. Called on the node's thread.
#pragma once

#include <stdint.h>

#include "swarmtalk/fragmenter.hpp"
#include "swarmtalk/publisher.hpp"
#include "swarmtalk/subscriber.hpp"

namespace swarmtalk {
namespace core {

template <class P>
class ChannelList;
template <class P>
class Swarmtalk;

/// Which of several publishers is told first that a message has left.
template <bool kSeveral>
class SentTurn {
 protected:
  uint8_t take_turn(uint8_t publishers) {
    const uint8_t turn = next_;
    if (++next_ >= publishers) next_ = 0;
    return turn;
  }
  uint8_t next_ = 0;
};
template <>
class SentTurn<false> {
 protected:
  uint8_t take_turn(uint8_t) { return 0; }
};

template <class P>
class Channel : private SentTurn<(P::kPublishers > 1)> {
 public:
  using W = Wire<P>;
  using ChannelId = typename W::ChannelId;
  using Distance = typename Subscriber<P>::Distance;

  ChannelId id() const { return node_->channel_id(index_); }
  uint8_t ttl() const { return ttl_; }
  bool is_timestamped() const { return timestamped_; }
  /// Longest message this channel carries, in bytes.
  uint16_t max_message_bytes() const {
    return timestamped_ ? W::kTimedMessageBytes : W::kMessageBytes;
  }
  /// A message waits or is being sent.
  bool is_busy() const { return fragmenter_.is_busy(); }

  /// @param sent  called when a message of this channel has left, may be null; in turn with the
  ///              other publishers' so that none starves
  /// @return null if all P::kPublishers are taken
  SWARMTALK_AVR_CALLED Publisher<P>* new_publisher(SentFn sent, void* context) {
    const uint8_t place = publishers();
    if (place == P::kPublishers) return nullptr;
    publishers_[place].set(this, sent, context);
    return &publishers_[place];
  }
  /// The paper's shape. A null `sent` is allowed.
  Publisher<P>* new_publisher(void (*sent)()) {
    const uint8_t place = publishers();
    if (place == P::kPublishers) return nullptr;
    publishers_[place].set_plain(this, sent);
    return &publishers_[place];
  }

  /// @param max_distance  packets from this far or farther are not for it: where they are for no
  ///                      subscriber, they are no part of a message
  /// @return null if all P::kSubscribers are taken
  SWARMTALK_AVR_CALLED Subscriber<P>* new_subscriber(Distance max_distance, ReceiveFn<P> receive,
                                                     void* context) {
    Subscriber<P>* const subscriber = free_subscriber();
    if (subscriber != nullptr) subscriber->set(max_distance, receive, context);
    return subscriber;
  }
  /// The paper's shape. A null `receive` is allowed.
  Subscriber<P>* new_subscriber(Distance max_distance, PlainReceiveFn<P> receive) {
    Subscriber<P>* const subscriber = free_subscriber();
    if (subscriber != nullptr) subscriber->set_plain(max_distance, receive);
    return subscriber;
  }

  /// See Publisher::send.
  Error publish(const uint8_t* bytes, uint16_t size) { return publish(bytes, size, ttl_, false); }
  SWARMTALK_AVR_CALLED Error publish(const uint8_t* bytes, uint16_t size, uint8_t ttl,
                                     bool crossed_gateway) {
    if (size > max_message_bytes()) return Error::kTooLong;
    if (size == 0 && !W::kTellsLengths) return Error::kEmpty;
    if (ttl > W::kTtlMax) return Error::kTtlTooLarge;
    if (fragmenter_.is_busy()) return Error::kBusy;
    if (ttl > top_ttl_) top_ttl_ = ttl & W::kTtlMax;
    fragmenter_.load(bytes, size, ttl, crossed_gateway, node_->wait_now());
    node_->set_waiting(index_);
    return Error::kOk;
  }

  /// The same for a message that its program handed over `waited` ticks ago: its delay counts from
  /// there.
  Error publish(const uint8_t* bytes, uint16_t size, uint8_t ttl, bool crossed_gateway,
                typename W::Ticks waited) {
    const Error error = publish(bytes, size, ttl, crossed_gateway);
    if (error == Error::kOk) fragmenter_.backdate(waited);
    return error;
  }
  /// Sends the message that has left last once more, under its number. A node that has it drops the
  /// copy for kOneHopDuplicateTicks; of a flooded message for longer only where numbers are wide.
  /// REQUIRES that one has left since the channel was opened.
  /// @return kOk; kBusy while a message has not left
  Error send_again() {
    if (fragmenter_.is_busy()) return Error::kBusy;
    fragmenter_.rewind();
    node_->set_waiting(index_);
    return Error::kOk;
  }
  /// The next message gets the number after `number`. REQUIRES !is_busy()
  void continue_after(typename W::MessageNumber number) { fragmenter_.continue_after(number); }
  /// No packet of the message in hand has been pulled yet. REQUIRES is_busy()
  bool is_unbegun() const { return fragmenter_.is_untouched(); }

 private:
  friend class Swarmtalk<P>;
  friend class ChannelList<P>;
  using MessageNumber = typename W::MessageNumber;
  using Ticks = typename W::Ticks;
  using Index = UintFor<bits_for(P::kChannels)>;

  /// `number` is the last message number used, of this channel or of any before it here.
  void init(Swarmtalk<P>* node, Index index, ChannelId id, uint8_t ttl, bool timestamped,
            MessageNumber number) {
    node_ = node;
    index_ = index;
    ttl_ = ttl & W::kTtlMax;
    timestamped_ = timestamped;
    is_open_ = true;
    for (uint8_t i = 0; i < P::kPublishers; ++i) publishers_[i].clear();
    for (uint8_t i = 0; i < P::kSubscribers; ++i) subscribers_[i].clear();
    typename W::Header header = {};
    header.channel = id;
    header.message = number;
    header.has_delay = timestamped;
    fragmenter_.reset(header);
  }

  /// Before the first packet of a message. The first message of all gets `first` added to its
  /// number.
  void begin_numbers(MessageNumber first) {
    if (has_begun_) return;
    has_begun_ = true;
    fragmenter_.continue_after(static_cast<MessageNumber>(fragmenter_.number() + first));
  }
  /// Whether a packet under our id may be one of our last messages, sent on by others: half of the
  /// numbers are behind the last one, and copies have lost TTL.
  bool has_flooded(MessageNumber message, uint8_t ttl) const {
    return ttl < top_ttl_ && static_cast<MessageNumber>((fragmenter_.number() - message) &
                                                        W::kMessageMask) <= W::kMessageMask / 2u;
  }

  uint8_t publishers() const {
    uint8_t count = 0;
    while (count < P::kPublishers && publishers_[count].is_used()) ++count;
    return count;
  }
  Subscriber<P>* free_subscriber() {
    for (uint8_t i = 0; i < P::kSubscribers; ++i) {
      if (!subscribers_[i].is_used()) return &subscribers_[i];
    }
    return nullptr;
  }
  bool has_subscribers() const { return subscribers_[0].is_used(); }

  bool wants(const typename P::Sensing& sensing) const {
    for (uint8_t i = 0; i < P::kSubscribers; ++i) {
      if (subscribers_[i].wants(sensing)) return true;
    }
    return false;
  }

  /// REQUIRES wants().
  void deliver(const uint8_t* bytes, uint16_t size, const Reception<P>& reception) {
    if (P::kSubscribers == 1) return subscribers_[0].call(bytes, size, reception);
    for (uint8_t i = 0; i < P::kSubscribers; ++i) {
      if (subscribers_[i].wants(reception.sensing)) subscribers_[i].call(bytes, size, reception);
    }
  }

  /// Tells every publisher, another one first each time, so that the first to send again rotates.
  void call_sent() {
    const uint8_t count = publishers();
    if (count == 0) return;
    uint8_t turn = this->take_turn(count);
    for (uint8_t n = count; n > 0; --n) {
      if (++turn >= count) turn = 0;
      publishers_[turn].call_sent();
    }
  }

  Swarmtalk<P>* node_;
  Publisher<P> publishers_[P::kPublishers];
  Subscriber<P> subscribers_[P::kSubscribers];
  Index index_;
  uint8_t ttl_;
  uint8_t top_ttl_;     // the largest that a message was given
  bool has_begun_ : 1;  // a packet of it has left
  bool timestamped_ : 1;
  bool is_open_ : 1;  // not removed
  Fragmenter<P> fragmenter_;
};

}  // namespace core
}  // namespace swarmtalk
