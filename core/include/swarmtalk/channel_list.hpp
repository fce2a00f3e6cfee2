// The channels of a node, in the order in which they were first opened; a place whose channel was
// removed is taken again. Owned by the node.
#pragma once

#include <stdint.h>

#include "swarmtalk/channel.hpp"
#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

/// Numbers up to here may have been used on a channel that is removed since. Where numbers are
/// narrow they come back anyhow, and nothing is kept.
template <class Number, bool kPresent>
class NumberFloor {
 protected:
  void raise_floor(Number number) {
    if (number > floor_) floor_ = number;
  }
  Number floor() const { return floor_; }
  Number floor_ = 0;
};
template <class Number>
class NumberFloor<Number, false> {
 protected:
  void raise_floor(Number) {}
  Number floor() const { return 0; }
};

template <class P>
class ChannelList : private NumberFloor<typename Wire<P>::MessageNumber, (P::kMessageBits >= 16)> {
 public:
  using W = Wire<P>;
  using ChannelId = typename W::ChannelId;
  using Index = UintFor<bits_for(P::kChannels)>;

  SWARMTALK_PART(ChannelList)
  void start() {
    set_zero(last_error_);
    set_zero(used_);
    set_zero(ids_);
  }

  Channel<P>& at(unsigned index) { return channels_[index]; }
  const Channel<P>& at(unsigned index) const { return channels_[index]; }
  ChannelId id(Index index) const { return ids_[index]; }

  /// @return null if this node does not have it
  Channel<P>* find(ChannelId id) {
    Channel<P>* channel = channels_;
    for (Index i = 0; i != used_; ++i, channel = in_register(channel + 1)) {
      if (ids_[i] == id && channel->is_open_) return channel;
    }
    return nullptr;
  }

  /// See Swarmtalk::new_channel.
  Channel<P>* open(Swarmtalk<P>& node, unsigned id, unsigned ttl, bool timestamped) {
    if (id > W::kChannelMax) return refuse(Error::kBadChannel);
    if (ttl > W::kTtlMax) return refuse(Error::kTtlTooLarge);
    return open_in_range(node, static_cast<ChannelId>(id), static_cast<uint8_t>(ttl), timestamped);
  }
  /// Why the last open() failed, or kOk.
  Error last_error() const { return last_error_; }

 private:
  Channel<P>* refuse(Error why) {
    last_error_ = why;
    return nullptr;
  }
  SWARMTALK_AVR_CALLED Channel<P>* open_in_range(Swarmtalk<P>& node, ChannelId id, uint8_t ttl,
                                                 bool timestamped) {
    Index place = used_;
    last_error_ = find_place(id, timestamped, place);
    if (last_error_ != Error::kOk) return nullptr;
    Channel<P>& channel = *in_register(&channels_[place]);
    typename W::MessageNumber number = channel.fragmenter_.number();
    if (place == used_ || ids_[place] != id) {
      if (place == used_) {
        ++used_;
      } else {
        this->raise_floor(number);
      }
      number = this->floor();
      channel.has_begun_ = false;
      channel.top_ttl_ = 0;
    }
    ids_[place] = id;
    channel.init(&node, place, id, ttl, timestamped, number);
    return &channel;
  }
  /// @param place  used_; gets the place where this channel was before (its message numbers go on
  ///               there), else a fresh one, else any that is free
  Error find_place(ChannelId id, bool timestamped, Index& place) const {
    if (timestamped && P::kTimestampBits == 0) return Error::kWrongTimestamps;
    if (P::kTimestampedFrom != kNoTimestampedChannels &&
        timestamped != (id >= P::kTimestampedFrom)) {
      return Error::kWrongTimestamps;
    }
    const Channel<P>* channel = &channels_[used_];
    for (Index i = used_; i-- != 0;) {
      channel = in_register(channel - 1);
      const bool is_open = channel->is_open_;
      if (ids_[i] == id) {
        place = i;
        return is_open ? Error::kAlreadyOpen : Error::kOk;
      }
      if (!is_open && used_ == P::kChannels) place = i;
    }
    return place == P::kChannels ? Error::kNoRoom : Error::kOk;
  }

  Error last_error_;
  Index used_;  // channels_[0..used_-1] have been used
  ChannelId ids_[P::kChannels];
  Channel<P> channels_[P::kChannels];
};

}  // namespace core
}  // namespace swarmtalk
