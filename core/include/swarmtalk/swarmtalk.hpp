// A SwarmTalk node: publish/subscribe over small broadcast packets, with forwarding. Passive and
// single-threaded: its owner calls it (on one thread, or with interrupts off), nothing else does.
// It owns all of its memory, uses no heap and no globals; a thousand nodes are an array.
//
// A platform gives it a Port (clock, random), calls pull_packet when its link can send and
// on_packet when its link has received: the four functions of Zhang et al., AAMAS 2020, sec. 3.
#pragma once

#include <stdint.h>

#include "swarmtalk/channel.hpp"
#include "swarmtalk/counters.hpp"
#include "swarmtalk/duplicate_cache.hpp"
#include "swarmtalk/forecast.hpp"
#include "swarmtalk/forward_limits.hpp"
#include "swarmtalk/forward_queue.hpp"
#include "swarmtalk/node_id.hpp"
#include "swarmtalk/port.hpp"
#include "swarmtalk/reassembler.hpp"
#include "swarmtalk/round_robin.hpp"

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
class Swarmtalk : private Forecast<P, (P::kBuckets == 0)>,
                  private NumberFloor<typename Wire<P>::MessageNumber, (P::kMessageBits >= 16)>,
                  public ForwardLimits<P> {
 public:
  using Profile = P;
  using W = Wire<P>;
  using NodeId = typename W::NodeId;
  using ChannelId = typename W::ChannelId;
  using Epoch = typename W::Epoch;
  using Sensing = typename P::Sensing;
  using Ticks = UintFor<P::kClockBits>;

  /// Touches little of its memory: a large profile stays cheap until its buffers are used.
  explicit Swarmtalk(const Port& port)
#ifdef __AVR__
  {
    memset(static_cast<void*>(this), 0, sizeof(*this));
    port_.clock = port.clock;
    port_.random = port.random;
    port_.context = port.context;
    Forecast<P, Cache::kScans>::start();
    identity_.start();
    round_robin_.start();
    cache_.start();
    reassembler_.start();
    forward_queue_.start();
  }
#else
      : port_{port.clock, port.random, port.context}, last_error_(Error::kOk), used_channels_(0) {
    set_zero(ids_);
  }
#endif
  Swarmtalk(const Swarmtalk&) = delete;
  Swarmtalk& operator=(const Swarmtalk&) = delete;

  /// Registers channel `id`.
  /// @param ttl          hops allowed after the first, 0..W::kTtlMax
  /// @param timestamped  messages carry their delay, at W::kTimestampBytes less payload per packet
  /// @return null when impossible; last_error() says why
  Channel<P>* new_channel(unsigned id, unsigned ttl, bool timestamped) {
    if (id > W::kChannelMax) return refuse(Error::kBadChannel);
    if (ttl > W::kTtlMax) return refuse(Error::kTtlTooLarge);
    return open_channel(static_cast<ChannelId>(id), static_cast<uint8_t>(ttl), timestamped);
  }

  /// Ends a channel: an unsent message is dropped, its publishers and subscribers must not be used
  /// any more. Not from inside a callback of the same channel.
  void remove_channel(Channel<P>* channel) {
    round_robin_.set_ready(static_cast<Source>(channel->index_ + 1u), false);
    channel->is_open_ = false;
  }

  /// Why the last new_channel failed, or kOk.
  Error last_error() const {
    return last_error_;
  }

  /// The next packet to send, if the link can take one now. Calls `sent` callbacks.
  /// @param out  W::kMtuBytes
  /// @return bytes written; 0: nothing waits
  SWARMTALK_AVR_CALLED uint16_t pull_packet(uint8_t* out) {
    uint32_t now = 0;
    if (!forward_queue_.is_empty()) {
      now = time();
      forget_stale(now);
    }
    drop_late_forwards();
    const Source source = round_robin_.next();
    if (source == RoundRobin<kSources>::kNone) return 0;
    count(counters_.packets_sent);
    return source == 0 ? pull_forwarded(static_cast<typename W::WaitTicks>(now), out)
                       : pull_own(channels_[source - 1], source, out);
  }

  /// Bytes of the packet that pull_packet() gives next; 0: nothing waits. A link asks first whether
  /// it fits, because a packet that has been pulled waits outside of its timestamp. Where packets
  /// to forward have waited for longer than the clock counts, the pull gives them up, and with them
  /// what was told here.
  uint16_t next_packet_bytes() const {
    const Source source = round_robin_.peek();
    if (source == RoundRobin<kSources>::kNone) return 0;
    if (source == 0) return forward_queue_.next_bytes();
    const Channel<P>& channel = channels_[source - 1];
    return channel.fragmenter_.next_bytes(channel.timestamped_);
  }

  /// Something waits to be pulled.
  bool has_packet() const {
    return round_robin_.is_any_ready();
  }

  /// Sends on packets of others with at most `max_ttl` hops left, and only if they have waited here
  /// for at most `max_wait` ticks: see ForwardLimits. Until this is called there is no limit.
  template <class Q = P>
  void limit_forwarding(uint8_t max_ttl, Ticks max_wait) {
    static_assert(Q::kLimitsForwarding, "this profile cannot limit forwarding: kLimitsForwarding");
    this->set_limits(max_ttl, max_wait);
  }

  /// Gives up what has waited to be sent on for longer than limit_forwarding() says. pull_packet()
  /// does it too; who asks next_packet_bytes() first calls it before that, at one time of the
  /// clock.
  void drop_late_forwards();

  /// Takes a packet that the link has received. Calls `receive` callbacks.
  /// @return kOk, also for one that is not for us; kBadPacket, kBadChecksum
  SWARMTALK_AVR_CALLED Error on_packet(const uint8_t* bytes, uint16_t size,
                                       const Sensing& sensing) {
    begin_call();
    count(counters_.packets_received);
    return take_packet(bytes, size, sensing);
  }

  /// Id under which this node sends; drawn when first needed.
  NodeId node_id() const {
    ensure_id();
    return identity_.id();
  }
  /// Fixes the id: it does not change by itself any more; collisions are still counted. W::kNoNode
  /// is nobody's: the node draws an id, now or when it is first needed, and may change it.
  void set_node_id(NodeId id) {
    identity_.fix(id, port_);
  }
  /// Distinguishes this start of the program from earlier ones (profiles with epoch bits).
  void set_epoch(uint16_t epoch) {
    identity_.set_epoch(static_cast<Epoch>(epoch));
  }

  const Counters<P>& counters() const {
    return counters_;
  }
  Ticks now() const {
    return static_cast<Ticks>(time());
  }

 private:
  friend class Channel<P>;
  friend class DuplicateCache<P>;
  using Header = typename W::Header;
  using PacketSize = typename W::PacketSize;
  using Cache = DuplicateCache<P>;
  using Key = RecordKey<P>;
  using Entry = Record<P>;
  using Mask = typename W::PacketMask;
  using Outcome = typename Reassembler<P>::Outcome;
  using Pushed = typename ForwardQueue<P>::Pushed;
  using ChannelIndex = UintFor<bits_for(P::kChannels)>;
  static constexpr uint16_t kSources = P::kChannels + 1;
  using Source = typename RoundRobin<kSources>::Source;
  using MessageNumber = typename W::MessageNumber;
  static constexpr Mask kAllPackets = static_cast<Mask>(~Mask{0});

  /// A packet on its way through the node.
  struct Arrival : Fragment<P> {
    Key key;
    PacketSize size_bytes;  // of the packet
    Channel<P>* to;         // null: not registered here
    const uint8_t* packet() const { return this->payload - W::kHeaderBytes; }
  };

  /// Since when something waits.
  typename W::WaitTicks wait_now() const {
    return static_cast<typename W::WaitTicks>(time());
  }
  SWARMTALK_AVR_CALLED uint32_t time() const {
    return port_.clock(port_.context);
  }
  SWARMTALK_AVR_INLINED void count(typename P::Counter& counter) {
    counters_.count(counter);
  }

  /// What is over by now is given up.
  void begin_call() {
    const uint32_t now = time();
    if (cache_.has_ended(now)) forget_all(now);
    const uint32_t passed = cache_.since_now(now);
    cache_.set_now(now);
    if (P::kBuckets == 0) cache_.set_waiting(forward_queue_.size());  // else told when it changes
    cache_.sweep(passed, *this);
  }
  /// After a pause in which nothing was heard.
  void forget_all(uint32_t now) {
    forget_stale(now);
    cache_.forget_all();
    reassembler_.forget_all();
  }
  /// What waits to be sent on for longer than the clock can count would say a wrong delay, and be
  /// taken for messages of today.
  SWARMTALK_AVR_CALLED void forget_stale(uint32_t time) {
    if (P::kClockBits == 32 || cache_.since_now(time) >> (P::kClockBits % 32) == 0) return;
    forward_queue_.clear();
    if (P::kBuckets != 0) cache_.set_waiting(0);
    round_robin_.set_ready(0, false);
  }
  /// An open message's time is over, or its number comes again.
  SWARMTALK_AVR_CALLED void expire(Entry& record) {
    reassembler_.release(record);
    count(counters_.aged_out);
  }

  // --- channels -----------------------------------------------------------------------------
  Channel<P>* refuse(Error why) {
    last_error_ = why;
    return nullptr;
  }
  /// @param id, ttl  in their fields' range
  SWARMTALK_AVR_CALLED Channel<P>* open_channel(ChannelId id, uint8_t ttl, bool timestamped) {
    ChannelIndex place = used_channels_;
    last_error_ = find_place(id, timestamped, place);
    if (last_error_ != Error::kOk) return nullptr;
    Channel<P>& channel = *in_register(&channels_[place]);
    MessageNumber number = channel.fragmenter_.number();
    if (place == used_channels_) {
      ++used_channels_;
      number = this->floor();
    } else if (ids_[place] != id) {
      this->raise_floor(number);
      number = this->floor();
    }
    ids_[place] = id;
    channel.init(this, place, id, ttl, timestamped, number);
    return &channel;
  }
  /// @param place  used_channels_; gets the place where this channel was before (its message
  ///               numbers go on there), else a fresh one, else any that is free
  Error find_place(ChannelId id, bool timestamped, ChannelIndex& place) const {
    if (timestamped && P::kTimestampBits == 0) return Error::kWrongTimestamps;
    if (P::kTimestampedFrom != kNoTimestampedChannels &&
        timestamped != (id >= P::kTimestampedFrom)) {
      return Error::kWrongTimestamps;
    }
    const Channel<P>* channel = &channels_[used_channels_];
    for (ChannelIndex i = used_channels_; i-- != 0;) {
      channel = in_register(channel - 1);
      const bool is_open = channel->is_open_;
      if (ids_[i] == id) {
        place = i;
        return is_open ? Error::kAlreadyOpen : Error::kOk;
      }
      if (!is_open && used_channels_ == P::kChannels) place = i;
    }
    return place == P::kChannels ? Error::kNoRoom : Error::kOk;
  }
  ChannelId channel_id(ChannelIndex index) const {
    return ids_[index];
  }

  /// @return null if this node does not have it
  Channel<P>* find_channel(ChannelId id) {
    Channel<P>* channel = channels_;
    for (ChannelIndex i = 0; i != used_channels_; ++i, channel = in_register(channel + 1)) {
      if (ids_[i] == id && channel->is_open_) return channel;
    }
    return nullptr;
  }
  void set_waiting(ChannelIndex index) {
    round_robin_.set_ready(static_cast<Source>(index + 1u), true);
  }

  // --- sending on: defined in forward_path.hpp ------------------------------------------------
  PacketSize pull_forwarded(typename W::WaitTicks now, uint8_t* out);
  /// Some have been taken out of the queue.
  SWARMTALK_AVR_INLINED void note_forwards();
  /// Queues a packet to be sent on, once.
  void forward(const Arrival& arrival, Entry& record);
  /// The same, its TTL being within the limits.
  void forward_unlimited(const Arrival& arrival, Entry& record);

  // --- sending ------------------------------------------------------------------------------
  SWARMTALK_AVR_CALLED PacketSize pull_own(Channel<P>& channel, Source source, uint8_t* out) {
    ensure_id();
    Fragmenter<P>& message = channel.fragmenter_;
    // A change of id never splits a message.
    if (message.is_untouched()) {
      message.set_sender(identity_.id(), identity_.epoch());
      channel.begin_numbers(identity_.first_number());
    }
    const PacketSize size = message.next(channel.timestamped_, wait_now(), out);
    if (!message.is_busy()) {
      round_robin_.set_ready(source, false);
      count(counters_.messages_sent);
      channel.call_sent();
    }
    return size;
  }

  void ensure_id() const {
    if (!identity_.is_drawn()) draw_id();
  }
  void draw_id() const {
    identity_.draw(port_, cache_);
  }

  /// An attacker who knew them could choose names of messages that make each search long.
  void draw_secret() {
    uint64_t words[2] = {0, 0};
    for (uint64_t& word : words) {
      word = static_cast<uint64_t>(port_.random(port_.context)) << 32;
      word |= port_.random(port_.context);
    }
    cache_.set_secret(words[0], words[1]);
  }

  // --- receiving ----------------------------------------------------------------------------
  /// Fills in what the packet holds of its message, and checks lengths and numbers against each
  /// other. @return false if they contradict
  bool read_fragment(Arrival& arrival, const uint8_t* packet) const;
  static bool fits_size(const Arrival& arrival, bool timestamped, PacketSize payload_bytes);

  /// Our own packet come back, or somebody else's under our id that has no epoch to tell the two
  /// apart: neither is received.
  bool is_own(const Arrival& arrival);
  /// Whether a packet under an id of ours is one that we have sent: others sent it on.
  bool is_echo(const Arrival& arrival) const {
    if (P::kEpochBits != 0) return arrival.epoch == identity_.epoch();
    return arrival.to != nullptr && arrival.to->has_flooded(arrival.message, arrival.ttl);
  }
  /// Of a flooded message's packet: whether its sender itself has sent it (nothing is off its TTL
  /// yet), or a forwarder, or nobody knows.
  static uint8_t kind_of(const Arrival& arrival) {
    uint8_t sent_ttl = arrival.ttl;
    if (P::kHopsBits != 0) {
      sent_ttl = static_cast<uint8_t>(sent_ttl + (arrival.hops != 0 ? 1 : 0));
    } else if (!P::kHopsFromTtl || arrival.to == nullptr || arrival.to->ttl_ < arrival.ttl) {
      return Entry::kFlood;
    } else {
      sent_ttl = arrival.to->ttl_;
    }
    return sent_ttl == arrival.ttl ? Entry::kFlood | Entry::kDirect
                                   : Entry::kFlood | Entry::kRelayed;
  }

  /// A packet that has been counted.
  Error take_packet(const uint8_t* bytes, uint16_t size, const Sensing& sensing) {
    const Error damage = W::check(bytes, size);
    if (damage != Error::kOk) {
      count(damage == Error::kBadChecksum ? counters_.bad_checksums : counters_.bad_packets);
      return damage;
    }
    Arrival arrival;
    arrival.size_bytes = static_cast<PacketSize>(size);
    arrival.sensing = sensing;
    W::decode(bytes, arrival);
    arrival.key = Key(bytes);
    Channel<P>* const channel = find_channel(arrival.channel);
    arrival.to = channel;
    if (!W::kMarksTimestamps) arrival.has_delay = channel != nullptr && channel->timestamped_;
    if (!read_fragment(arrival, bytes)) {
      count(counters_.bad_packets);
      return Error::kBadPacket;
    }
    if (!is_own(arrival)) receive(arrival);
    return Error::kOk;
  }

  // --- what a received packet goes through: defined in receive_path.hpp -----------------------
  void receive(Arrival& arrival);
  /// The record of a packet's message, a new one if needed. Null: no room.
  Entry* record_of(const Arrival& arrival, uint8_t kind, bool whole);
  /// DuplicateCache::begin_record, with numbers for its table when the first one begins.
  Entry* begin_record(Entry* own, typename Key::Argument key, uint8_t kind, bool insist);
  void assemble(Arrival& arrival, Entry& record);
  /// The message lies on the stack.
  void complete(Arrival& arrival, Entry& record, Ticks elapsed);
  void deliver(Arrival& arrival, const uint8_t* bytes, uint16_t size);
  /// An open message is delivered, or given up.
  /// @param heard  packets of it that have come beside those held, or 0
  void finish(Entry& record, Mask heard);
  /// Whether memory will do for the message that this packet begins.
  bool is_finishable(const Arrival& arrival, const Entry& record) const {
    return !this->knows_length() || record.is_flood() || (arrival.bit == 1 && this->has_room());
  }
  /// What keeping an open message is worth: nothing if it cannot become whole any more, as far as
  /// one can tell, else more with each packet held. To finish what has come farthest takes the
  /// least memory for a message. (One hop means in order: a gap is a loss, and so is the sender's
  /// next.)
  SWARMTALK_AVR_INLINED uint8_t worth(const Entry& record) const;
  static constexpr uint8_t kAnyWorth = 255;
  /// Gives up the open message that is worth least, other than `kept`, if that is less than
  /// `limit`; of any worth, one that holds few packets. Without buckets it is known from the last
  /// walk over the records. @return it, now closed, or null
  Entry* give_up_less_than(uint8_t limit, const Entry* kept);
  /// Finds it in a large table, by standing: of some that hold packets, the least, and the oldest.
  Entry* find_less_than(uint8_t limit, const Entry* kept);
  /// Gives up a message that is worth less than this packet's, which needs a slot.
  /// @return whether there was one
  bool make_slot(Entry& record, const Arrival& arrival);
  /// What a packet's message may push out, of which `held` are here: what is worth less than this.
  static uint8_t limit_of(Mask held, const Arrival& arrival);
  /// In a large table, how an open message stands among others: 0 if it is worth nothing;
  /// kEndAlone; kStalled, and one more for each packet held, less one for each kStall in which none
  /// has come.
  uint8_t standing(const Entry& record) const;
  static constexpr uint8_t kEndAlone = 1;
  static constexpr uint8_t kStalled = 2;
  static constexpr uint32_t kStall = P::kAssemblyTicks < 8 ? 1 : P::kAssemblyTicks / 8;

  // The small ones first: AVR reaches 64 bytes behind an address at no cost.
  Port port_;
  mutable NodeIdentity<P> identity_;
  RoundRobin<kSources> round_robin_;
  Error last_error_;
  ChannelIndex used_channels_;  // channels_[0..used_channels_-1] have been used
  ChannelId ids_[P::kChannels];
  Counters<P> counters_;
  Cache cache_;
  Reassembler<P> reassembler_;
  ForwardQueue<P> forward_queue_;
  Channel<P> channels_[P::kChannels];
};

}  // namespace core
}  // namespace swarmtalk

#include "swarmtalk/forward_path.hpp"
#include "swarmtalk/receive_path.hpp"
