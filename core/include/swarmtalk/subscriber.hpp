// Who is called with the messages of a channel. Made by Channel::new_subscriber, lives in the
// channel. Called on the node's thread, from inside Swarmtalk::on_packet.
#pragma once

#include <stdint.h>

#include "swarmtalk/aligned.hpp"
#include "swarmtalk/sensing.hpp"

namespace swarmtalk {
namespace core {

template <class P>
class Channel;

/// Called with one message. `bytes` is valid during the call.
template <class P>
using ReceiveFn = void (*)(void* context, const uint8_t* bytes, uint16_t size,
                           const Reception<P>& reception);

/// The same in the shape of Zhang et al., AAMAS 2020, sec. 2.3. The program may write to the
/// message and to its copy of the sensing.
template <class P>
using PlainReceiveFn = void (*)(unsigned char* message, int size, int ttl,
                                typename P::Sensing* sensing);

template <class P>
class Subscriber {
 public:
  using Distance = typename P::Sensing::Distance;

  /// Whether a message whose last packet came from so far is wanted.
  bool wants(const typename P::Sensing& sensing) const {
    return is_used() && sensing.is_within(max_distance_);
  }

 private:
  friend class Channel<P>;
  /// A plain function travels in place of the context, to a function that calls it.
  union Target {
    void* context;
    PlainReceiveFn<P> plain;
  };
  static void call_plain(void* context, const uint8_t* bytes, uint16_t size,
                         const Reception<P>& reception) {
    Target target;
    target.context = context;
    typename P::Sensing sensing = reception.sensing;
    with_aligned<P>(bytes, size, [&](unsigned char* message) {
      target.plain(message, static_cast<int>(size), reception.ttl, &sensing);
    });
  }

  static void call_nothing(void*, const uint8_t*, uint16_t, const Reception<P>&) {}

  void clear() { receive_ = nullptr; }
  bool is_used() const { return receive_ != nullptr; }
  void set(Distance max_distance, ReceiveFn<P> receive, void* context) {
    max_distance_ = max_distance;
    receive_ = receive == nullptr ? &call_nothing : receive;
    context_ = context;
  }
  void set_plain(Distance max_distance, PlainReceiveFn<P> receive) {
    Target target;
    target.plain = receive;
    set(max_distance, receive == nullptr ? nullptr : &call_plain, target.context);
  }
  void call(const uint8_t* bytes, uint16_t size, const Reception<P>& reception) {
    receive_(context_, bytes, size, reception);
  }

  Distance max_distance_;
  ReceiveFn<P> receive_;  // null: this place is free
  void* context_;
};

}  // namespace core
}  // namespace swarmtalk
