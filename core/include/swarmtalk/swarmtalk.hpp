// A SwarmTalk node: publish/subscribe over small broadcast packets, with forwarding. Passive and
// single-threaded: its owner calls it (on one thread, or with interrupts off), nothing else does.
// It owns all of its memory, uses no heap and no globals; a thousand nodes are an array.
//
// A platform gives it a Port (clock, random), calls pull_packet when its link can send and
// on_packet when its link has received: the four functions of Zhang et al., AAMAS 2020, sec. 3.
#pragma once

#include <stdint.h>

#include "swarmtalk/arrival.hpp"
#include "swarmtalk/channel_list.hpp"
#include "swarmtalk/forward_limits.hpp"
#include "swarmtalk/forward_queue.hpp"
#include "swarmtalk/heard_messages.hpp"
#include "swarmtalk/node_id.hpp"
#include "swarmtalk/port.hpp"
#include "swarmtalk/round_robin.hpp"

namespace swarmtalk {
namespace core {

template <class P>
class Swarmtalk : public ForwardLimits<P> {
 public:
  using Profile = P;
  using W = Wire<P>;
  using NodeId = typename W::NodeId;
  using ChannelId = typename W::ChannelId;
  using Epoch = typename W::Epoch;
  using Sensing = typename P::Sensing;
  using Ticks = UintFor<P::kClockBits>;

  /// Touches little of its memory: a large profile stays cheap until its buffers are used.
  explicit Swarmtalk(const Port& port) {
    if (kNodeStartsParts) memset(static_cast<void*>(this), 0, sizeof(*this));
    port_.clock = port.clock;
    port_.random = port.random;
    port_.context = port.context;
    if (kNodeStartsParts) {
      ForwardLimits<P>::start();
      identity_.start();
      round_robin_.start();
      heard_.start();
      forward_queue_.start();
    }
  }
  Swarmtalk(const Swarmtalk&) = delete;
  Swarmtalk& operator=(const Swarmtalk&) = delete;

  /// Registers channel `id`.
  /// @param ttl          hops allowed after the first, 0..W::kTtlMax
  /// @param timestamped  messages carry their delay, at W::kTimestampBytes less payload per packet
  /// @return null when impossible; last_error() says why
  Channel<P>* new_channel(unsigned id, unsigned ttl, bool timestamped) {
    return channels_.open(*this, id, ttl, timestamped);
  }

  /// Ends a channel: an unsent message is dropped, its publishers and subscribers must not be used
  /// any more. Not from inside a callback of the same channel.
  void remove_channel(Channel<P>* channel) {
    round_robin_.set_ready(static_cast<Source>(channel->index_ + 1u), false);
    channel->is_open_ = false;
  }

  /// Why the last new_channel failed, or kOk.
  Error last_error() const { return channels_.last_error(); }

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
    count(heard_.counters.packets_sent);
    return source == 0 ? pull_forwarded(static_cast<typename W::WaitTicks>(now), out)
                       : pull_own(channels_.at(source - 1u), source, out);
  }

  /// Bytes of the packet that pull_packet() gives next; 0: nothing waits. A link asks first whether
  /// it fits, because a packet that has been pulled waits outside of its timestamp. Where nothing
  /// was received for longer than the clock counts, the pull gives up what waits to be forwarded,
  /// and with it what was told here.
  uint16_t next_packet_bytes() const {
    const Source source = round_robin_.peek();
    if (source == RoundRobin<kSources>::kNone) return 0;
    if (source == 0) return forward_queue_.next_bytes();
    const Channel<P>& channel = channels_.at(source - 1u);
    return channel.fragmenter_.next_bytes(channel.timestamped_);
  }

  /// Something waits to be pulled.
  bool has_packet() const { return round_robin_.is_any_ready(); }

  /// Sends on packets of others as if they allowed at most `max_ttl` hops, and only if they have
  /// waited here for at most `max_wait` ticks: see ForwardLimits. Until this is called there is no
  /// limit.
  template <class Q = P>
  void limit_forwarding(uint8_t max_ttl, Ticks max_wait) {
    static_assert(Q::kLimitsForwarding, "this profile cannot limit forwarding: kLimitsForwarding");
    this->set_limits(max_ttl, max_wait);
  }

  /// Gives up what has waited to be sent on for longer than limit_forwarding() says. pull_packet()
  /// does it too; who asks next_packet_bytes() first calls it before that, at one time of the
  /// clock.
  void drop_late_forwards() {
    if (this->max_wait() == 0 || forward_queue_.is_empty()) return;
    const auto dropped = forward_queue_.drop_older_than(
        static_cast<typename W::WaitTicks>(this->max_wait()), wait_now());
    if (dropped == 0) return;
    this->count_too_late(dropped);
    note_forwards();
  }

  /// Takes a packet that the link has received. Calls `receive` callbacks.
  /// @return kOk, also for one that is not for us; kBadPacket, kBadChecksum
  SWARMTALK_AVR_CALLED Error on_packet(const uint8_t* bytes, uint16_t size,
                                       const Sensing& sensing) {
    begin_call();
    count(heard_.counters.packets_received);
    return take_packet(bytes, size, sensing);
  }

  /// Id under which this node sends; drawn when first needed.
  NodeId node_id() const {
    ensure_id();
    return identity_.id();
  }
  /// Fixes the id: it does not change by itself any more; collisions are still counted. W::kNoNode
  /// is nobody's: the node draws an id when it is first needed, and may change it.
  void set_node_id(NodeId id) { identity_.fix(id, port_); }
  /// Distinguishes this start of the program from earlier ones (profiles with epoch bits).
  void set_epoch(uint16_t epoch) { identity_.set_epoch(static_cast<Epoch>(epoch)); }

  const Counters<P>& counters() const { return heard_.counters; }
  Ticks now() const { return static_cast<Ticks>(time()); }

 private:
  friend class Channel<P>;
  using PacketSize = typename W::PacketSize;
  using Entry = Record<P>;
  using Mask = typename W::PacketMask;
  using Pushed = typename ForwardQueue<P>::Pushed;
  using ChannelIndex = typename ChannelList<P>::Index;
  static constexpr uint16_t kSources = P::kChannels + 1;
  using Source = typename RoundRobin<kSources>::Source;

  using Arrival = core::Arrival<P>;

  /// The time now, as wide as waits are counted.
  typename W::WaitTicks wait_now() const { return static_cast<typename W::WaitTicks>(time()); }
  SWARMTALK_AVR_CALLED uint32_t time() const { return port_.clock(port_.context); }
  SWARMTALK_AVR_INLINED void count(typename P::Counter& counter) { heard_.counters.count(counter); }

  /// What is over by now is given up.
  void begin_call() {
    const uint32_t now = time();
    if (heard_.has_ended(now)) forget_all(now);
    if (P::kBuckets == 0) heard_.set_waiting(forward_queue_.size());  // else told when it changes
    heard_.set_now(now);
  }
  /// After a pause in which nothing was heard.
  void forget_all(uint32_t now) {
    forget_stale(now);
    heard_.forget_all();
  }
  /// What waits to be sent on for longer than the clock can count would say a wrong delay, and be
  /// taken for messages of today. Where nothing was received for so long, all that waits has.
  SWARMTALK_AVR_CALLED void forget_stale(uint32_t time) {
    if (P::kClockBits == 32 || heard_.since_now(time) >> (P::kClockBits % 32) == 0) return;
    forward_queue_.clear();
    if (P::kBuckets != 0) heard_.set_waiting(0);
    round_robin_.set_ready(0, false);
  }

  ChannelId channel_id(ChannelIndex index) const { return channels_.id(index); }
  void set_waiting(ChannelIndex index) {
    round_robin_.set_ready(static_cast<Source>(index + 1u), true);
  }

  // --- sending on -----------------------------------------------------------------------------
  /// Queues a packet to be sent on, once.
  void forward(const Arrival& arrival, Entry& record) {
    if (this->allowed_ttl(arrival.ttl) == arrival.ttl) return forward_unlimited(arrival, record);
    Arrival limited = arrival;
    limited.ttl = this->allowed_ttl(arrival.ttl);
    forward_unlimited(limited, record);
  }
  /// The same, its TTL being within the limits.
  SWARMTALK_AVR_INLINED void forward_unlimited(const Arrival& arrival, Entry& record) {
    if ((record.forwarded & arrival.bit) != 0) {
      forward_queue_.improve(arrival.packet(), arrival);
      return;
    }
    const auto pushed = forward_queue_.push(arrival.packet(), arrival.size_bytes, arrival,
                                            static_cast<typename W::WaitTicks>(heard_.now()));
    if (pushed != Pushed::kDone) count(heard_.counters.forward_queue_full);
    if (pushed == Pushed::kFull) return;
    heard_.note_forwarded(record, arrival.bit);
    if (P::kBuckets != 0) heard_.set_waiting(forward_queue_.size());
    round_robin_.set_ready(0, true);
  }
  inline PacketSize pull_forwarded(typename W::WaitTicks now, uint8_t* out) {
    const uint8_t* packet = forward_queue_.next();
    bool timestamped = W::is_timestamped(packet);
    if (!W::kMarksTimestamps) {
      const Channel<P>* channel = channels_.find(W::ChannelField::get(packet));
      timestamped = channel != nullptr && channel->timestamped_;
    }
    const PacketSize size = forward_queue_.pull(timestamped, now, out);
    note_forwards();
    count(heard_.counters.packets_forwarded);
    return size;
  }
  /// Some have been taken out of the queue.
  SWARMTALK_AVR_INLINED void note_forwards() {
    if (P::kBuckets != 0) heard_.set_waiting(forward_queue_.size());
    if (forward_queue_.is_empty()) round_robin_.set_ready(0, false);
  }

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
      count(heard_.counters.messages_sent);
      channel.call_sent();
    }
    return size;
  }

  void ensure_id() const {
    if (!identity_.is_drawn()) draw_id();
  }
  void draw_id() const { identity_.draw(port_, heard_); }

  // --- receiving ----------------------------------------------------------------------------
  /// Whether a packet is not received because it is under our id: our own, sent on by others
  /// (is_echo), or without epochs also somebody else's. With epochs that is received.
  bool is_own(const Arrival& arrival) {
    if (!identity_.is_drawn() || arrival.node != identity_.id()) return false;
    if (is_echo(arrival)) {
      count(heard_.counters.own_echoes);
      return true;
    }
    count(heard_.counters.id_collisions);
    if (!identity_.is_fixed()) {
      draw_id();
      count(heard_.counters.id_changes);
    }
    return P::kEpochBits == 0;
  }
  /// Whether a packet under our id is one that we have sent. Without epochs only a channel that is
  /// open here can tell, by number and TTL.
  bool is_echo(const Arrival& arrival) const {
    if (P::kEpochBits != 0) return arrival.epoch == identity_.epoch();
    return arrival.to != nullptr && arrival.to->has_flooded(arrival.message, arrival.ttl);
  }
  /// A packet that has been counted.
  Error take_packet(const uint8_t* bytes, uint16_t size, const Sensing& sensing) {
    const Error damage = W::check(bytes, size);
    if (damage != Error::kOk) {
      count(damage == Error::kBadChecksum ? heard_.counters.bad_checksums
                                          : heard_.counters.bad_packets);
      return damage;
    }
    Arrival arrival;
    arrival.sensing = sensing;
    arrival.read_header(bytes, size);
    Channel<P>* const channel = channels_.find(arrival.channel);
    arrival.to = channel;
    if (!W::kMarksTimestamps) arrival.has_delay = channel != nullptr && channel->timestamped_;
    if (!arrival.read_fragment(bytes)) {
      count(heard_.counters.bad_packets);
      return Error::kBadPacket;
    }
    if (!is_own(arrival)) receive(arrival);
    return Error::kOk;
  }

  /// Wanted here or not, seen before or not, held until its message is whole.
  void receive(Arrival& arrival) {
    bool wanted = arrival.to != nullptr && arrival.to->has_subscribers();
    if (!wanted) {
      count(heard_.counters.unknown_channels);
    } else if (!arrival.to->wants(arrival.sensing)) {
      count(heard_.counters.too_far);
      wanted = false;
    }
    if (!wanted && arrival.ttl == 0) return;
    const uint8_t kind = arrival.ttl != 0 || arrival.to->ttl_ != 0 ? arrival.kind() : uint8_t{0};
    const bool whole = arrival.is_whole();
    heard_.draw_secret(port_);
    Entry* const record = heard_.record_of(arrival, kind, whole);
    // Without a record the copies of a flooded message could not be told from it.
    if (record == nullptr && (kind != 0 || !whole)) return count(heard_.counters.no_memory);
    if ((kind & (Entry::kFlood | Entry::kDirect)) == Entry::kFlood) heard_.hear_copy(*record);
    if (this->is_sent_on(arrival.ttl)) forward(arrival, *record);
    if (!wanted) return;
    if (record != nullptr) {
      if (record->is_done()) {
        record->held = static_cast<Mask>(record->held | arrival.bit);
        return count(heard_.counters.duplicates);
      }
      if (!whole || record->is_open()) {
        return put_together(arrival, *record);
      }
      heard_.close(*record);
    }
    deliver(arrival, arrival.payload, arrival.payload_bytes);
  }
  /// The message lies on the stack.
  void put_together(Arrival& arrival, Entry& record) {
    uint8_t message[W::kMessageBytes];
    const uint16_t size = heard_.add(arrival, record, message);
    if (size != 0) deliver(arrival, message, size);
  }
  void deliver(Arrival& arrival, const uint8_t* bytes, uint16_t size) {
    if (P::kHopsBits == 0) {
      const uint8_t sent_ttl = arrival.to->ttl_;
      arrival.hops = P::kHopsFromTtl && sent_ttl >= arrival.ttl
                         ? static_cast<uint8_t>(sent_ttl - arrival.ttl)
                         : kHopsUnknown;
    }
    count(heard_.counters.messages_received);
    arrival.to->deliver(bytes, size, arrival);
  }

  // The small ones first: AVR reaches 64 bytes behind an address at no cost.
  Port port_;
  mutable NodeIdentity<P> identity_;
  RoundRobin<kSources> round_robin_;
  HeardMessages<P> heard_;
  ForwardQueue<P> forward_queue_;
  ChannelList<P> channels_;
};

}  // namespace core
}  // namespace swarmtalk
