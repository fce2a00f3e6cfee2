// The handle through which a program sends on a channel. Made by Channel::new_publisher, lives in
// the channel. Called on the node's thread.
#pragma once

#include <stdint.h>

#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

template <class P>
class Channel;

/// Called when the last packet of the channel's message has been pulled; may call send().
using SentFn = void (*)(void* context);

template <class P>
class Publisher {
 public:
  /// Hands over one message; `bytes` is copied. It goes out at the channel's TTL.
  /// @param size  1..Wire<P>::kMessageBytes (kTimedMessageBytes if timestamped); 0 where the wire
  ///              keeps lengths
  /// @return kOk; kBusy while the channel's previous message has not left; kTooLong; kEmpty
  Error send(const uint8_t* bytes, uint16_t size) { return channel_->publish(bytes, size); }

  /// The same with a TTL of its own, and marked as copied by a gateway (kept if the wire can).
  /// @return also kTtlTooLarge
  Error send(const uint8_t* bytes, uint16_t size, uint8_t ttl, bool crossed_gateway) {
    return channel_->publish(bytes, size, ttl, crossed_gateway);
  }

  /// Whether send() would not answer kBusy.
  bool available() const { return !channel_->is_busy(); }

  Channel<P>* channel() const { return channel_; }

 private:
  friend class Channel<P>;
  /// A plain function travels in place of the context, to a function that calls it.
  union Target {
    void* context;
    void (*plain)();
  };
  static void call_plain(void* context) {
    Target target;
    target.context = context;
    target.plain();
  }

  static void call_nothing(void*) {}

  void clear() { sent_ = nullptr; }
  bool is_used() const { return sent_ != nullptr; }
  void set(Channel<P>* channel, SentFn sent, void* context) {
    channel_ = channel;
    sent_ = sent == nullptr ? &call_nothing : sent;
    context_ = context;
  }
  void set_plain(Channel<P>* channel, void (*sent)()) {
    Target target;
    target.plain = sent;
    set(channel, sent == nullptr ? nullptr : &call_plain, target.context);
  }
  void call_sent() { sent_(context_); }

  Channel<P>* channel_;
  SentFn sent_;  // null: this place is free
  void* context_;
};

}  // namespace core
}  // namespace swarmtalk
