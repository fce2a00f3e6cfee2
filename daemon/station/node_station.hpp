// NodeStation: a Station on a core node of profile P. It owns the link, answers its pulls from the
// node, measures distance and bearing of what it hears, and turns the node's callbacks into calls
// of the hub.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/common/number_table.hpp"
#include "daemon/message/gateway_origin.hpp"
#include "daemon/pose/pose_keeper.hpp"
#include "daemon/pose/ranging.hpp"
#include "daemon/station/hearing.hpp"
#include "daemon/station/last_messages.hpp"
#include "daemon/station/node_identity.hpp"
#include "daemon/station/node_words.hpp"
#include "daemon/station/range_once.hpp"
#include "daemon/station/repairing.hpp"
#include "daemon/station/station.hpp"
#include "daemon/station/station_clock.hpp"
#include "loop/chance.hpp"
#include "loop/clock.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::daemon {

template <class P>
class NodeStation final : public Station, public drivers::LinkUser {
 public:
  /// All references must outlive the station. @param link  not yet started
  NodeStation(std::string name, ProfileName profile, std::unique_ptr<drivers::Link> link,
              NodeIdentity& identity, const PoseKeeper& poses, StationUser& user)
      : name_(std::move(name)),
        profile_(profile),
        identity_(identity),
        poses_(poses),
        user_(user),
        node_(std::make_unique<Node>(core::Port{&clock_ticks, &random, this})),
        link_(std::move(link)) {
    adopt_node_id();
    node_->set_epoch(static_cast<std::uint16_t>(identity.epoch()));
  }

  void start() override { link_->start(*this); }

  const std::string& name() const override { return name_; }
  const char* profile() const override { return profile_.text; }
  NodeIdentity& identity() override { return identity_; }
  const StationLimits& limits() const override { return kLimits; }
  bool is_up() const override { return link_->is_up(); }
  std::size_t message_bytes_that_fit(bool is_timestamped) const override {
    return daemon::message_bytes_that_fit<P>(link_->packet_limit_bytes(), is_timestamped);
  }
  drivers::Link& link() override { return *link_; }
  drivers::Counters counters() const override;
  std::vector<Neighbour> neighbours(Neighbour::Time now) const override {
    return neighbours_.list(now);
  }

  bool open_channel(std::uint16_t number, bool is_timestamped) override {
    auto entry = std::make_unique<Entry>();
    entry->station = this;
    entry->number = number;
    entry->is_timestamped = is_timestamped;
    if (!attach(*entry)) return false;
    entries_[number] = std::move(entry);
    return true;
  }

  void close_channel(std::uint16_t number) override {
    repairing_.forget(number);
    set_sending(*entries_[number], false);
    node_->remove_channel(entries_[number]->channel);
    entries_[number].reset();
  }

  void set_listening(std::uint16_t number, bool is_listening) override {
    Entry& entry = *entries_[number];
    if (entry.is_listening == is_listening) return;
    // Core has no other way to unsubscribe than a new channel. When it is busy, the hub drops what
    // comes, and calls again where it can.
    if (!is_listening && entry.channel->is_busy()) return;
    entry.is_listening = is_listening;
    if (is_listening) {
      subscribe(entry);
    } else {
      reattach(entry);
    }
  }

  SendResult send(std::uint16_t number, std::span<const std::uint8_t> payload, std::uint8_t ttl,
                  const GatewayOrigin* origin, std::uint64_t waited_us,
                  std::uint32_t& message_number) override {
    const std::uint8_t redundancy = repairing_.take_wanted();
    Entry& entry = *entries_[number];
    const bool is_marked = origin != nullptr && kLimits.marks_gateways;
    if (is_marked) {
      crossing_.clear();
      append_origin(*origin, crossing_);
      crossing_.insert(crossing_.end(), payload.begin(), payload.end());
      payload = crossing_;
    }
    // Ours is behind while the message goes over other links only: this one was down, say.
    std::uint32_t& last = numbers_[number];
    if (P::kMessageBits == 32 && message_number > last + 1 && !entry.channel->is_busy()) {
      last = message_number - 1;
      entry.channel->continue_after(static_cast<typename W::MessageNumber>(last));
    }
    const auto waited = static_cast<Ticks>(
        std::min<std::uint64_t>(waited_us / kTickUs<P>, std::numeric_limits<Ticks>::max()));
    const core::Error error = entry.channel->publish(
        payload.data(), static_cast<std::uint16_t>(payload.size()), ttl, is_marked, waited);
    if (error == core::Error::kBusy) return SendResult::kBusy;
    if (error != core::Error::kOk) return SendResult::kRefused;
    set_sending(entry, true);
    entry.is_again = false;
    message_number = ++last;
    if (redundancy != 0) {
      repairing_.protect(number, last, payload.size(), entry.is_timestamped, redundancy,
                         neighbours_);
    }
    link_->wake();
    return SendResult::kSent;
  }

  bool has_redundancy() const override { return Repairing<P>::kIsThere; }
  void protect_next(std::uint8_t redundancy) override { repairing_.want(redundancy); }

  bool send_again(std::uint16_t number) override {
    if (!entries_[number]->has_sent) return false;  // a new channel since
    if (entries_[number]->channel->send_again() != core::Error::kOk) return false;
    set_sending(*entries_[number], true);
    entries_[number]->is_again = true;
    repairing_.repeats(number);
    link_->wake();
    return true;
  }

  void cancel(std::uint16_t number) override {
    Entry& entry = *entries_[number];
    if (!entry.channel->is_busy()) return;
    repairing_.forget(number);
    if (entry.is_again || !entry.channel->is_unbegun()) {
      note_left(entry);  // whoever has not heard all of it is told of a loss
    } else if (numbers_[number] > 0) {
      --numbers_[number];  // nobody has heard of it: skipping it would look like a loss
    }
    reattach(entry);
  }

  void adopt_node_id() override {
    node_->set_node_id(static_cast<typename W::NodeId>(identity_.id()));
  }

  void set_virtual_range(const VirtualRange& range) override { hearing_.set_virtual_range(range); }
  void set_ghosts(bool are_heard) override { hearing_.set_ghosts(are_heard); }
  void set_forwarding(const Forwarding& forwarding) override {
    const std::uint64_t wait_us = std::uint64_t{forwarding.max_wait_ms} * 1000;
    node_->limit_forwarding(forwarding.is_on ? forwarding.max_ttl : std::uint8_t{0},
                            static_cast<Ticks>((wait_us + kTickUs<P> - 1) / kTickUs<P>));
    repairing_.limit_forwarding(forwarding);
  }

  // LinkUser
  std::size_t pull_packet(std::span<std::uint8_t> out) override {
    if (!repairing_.is_idle()) {
      if (const auto repair = repairing_.pull(node_bytes(), out, *link_)) return *repair;
    }
    if (!node_->has_packet()) return 0;
    clock_.hold(loop::now());
    const std::size_t next_bytes = node_bytes();
    std::size_t size_bytes = 0;
    if (next_bytes != 0 && next_bytes <= out.size()) {
      size_bytes = node_->pull_packet(out.data());
      if (!repairing_.is_idle()) repairing_.sent(out.first(size_bytes), *link_);
      if (Entry* const sent = std::exchange(sent_, nullptr)) tell_sent(*sent);
    }
    clock_.release();
    return size_bytes;
  }
  std::size_t next_packet_bytes() override {
    const std::size_t bytes = node_bytes();
    return repairing_.is_idle() ? bytes : repairing_.waiting_bytes(bytes, *link_);
  }
  bool has_forwards_only() override {
    if (sending_ != 0 || repairing_.has_own()) return false;
    return node_->has_packet() || repairing_.has_relayed();
  }
  void on_packet(std::span<const std::uint8_t> packet,
                 const drivers::FrameReception& frame) override;
  void on_frame(const drivers::FrameReception& frame) override;
  void on_link_state() override { user_.on_link_state(*this); }
  std::size_t last_messages(std::span<frame::LastMessage> out) override { return left_.take(out); }
  void on_last_message(const frame::LastMessage& last,
                       const drivers::FrameReception& frame) override;
  bool is_own_frame(const frame::FrameHeader& header) override {
    return header.epoch == identity_.epoch() && identity_.was(header.node);
  }
  frame::FrameHeader frame_header() override {
    repairing_.begin_frame();
    frame::FrameHeader header;
    header.profile = profile_.id;
    header.node = identity_.id();
    header.epoch = identity_.epoch();
    header.pose = poses_.on_air(loop::now());
    return header;
  }

 private:
  using Node = core::Swarmtalk<P>;
  using W = core::Wire<P>;
  using Ticks = typename W::Ticks;

  struct Entry {
    NodeStation* station = nullptr;
    std::uint16_t number = 0;
    bool is_timestamped = false;
    bool is_listening = false;
    bool has_sent = false;  // its channel of core still has the last message
    bool is_sending = false;
    bool is_again = false;  // what it sends, or has sent last, is a copy
    core::Channel<P>* channel = nullptr;
    core::Publisher<P>* publisher = nullptr;
    std::uint32_t* left = nullptr;  // its place in left_, once a message has left
  };

  std::size_t node_bytes() {
    node_->drop_late_forwards();
    return node_->next_packet_bytes();
  }

  static constexpr StationLimits kLimits = limits_of_profile<P>();
  using Distance = typename P::Sensing::Distance;
  static constexpr Distance kNoLimit = std::numeric_limits<Distance>::has_infinity
                                           ? std::numeric_limits<Distance>::infinity()
                                           : std::numeric_limits<Distance>::max();

  static std::uint32_t clock_ticks(void* station) {
    const auto now = static_cast<NodeStation*>(station)->clock_.now();
    return static_cast<std::uint32_t>(now.count() / kTickUs<P>);
  }
  static std::uint32_t random(void*) { return loop::random_bits(); }

  bool attach(Entry& entry) {
    // TTL 0: each message brings its own.
    entry.channel = node_->new_channel(entry.number, 0, entry.is_timestamped);
    if (entry.channel == nullptr) return false;
    entry.has_sent = false;
    // From another place in the node its count might begin elsewhere: a gap that is not a loss.
    if (P::kMessageBits == 32) {
      entry.channel->continue_after(static_cast<typename W::MessageNumber>(numbers_[entry.number]));
    }
    entry.publisher = entry.channel->new_publisher(&on_core_sent, &entry);
    if (entry.is_listening) subscribe(entry);
    return true;
  }
  void reattach(Entry& entry) {
    set_sending(entry, false);
    node_->remove_channel(entry.channel);
    attach(entry);  // into the slot that has just become free
  }
  void set_sending(Entry& entry, bool is_sending) {
    if (std::exchange(entry.is_sending, is_sending) != is_sending) sending_ += is_sending ? 1 : -1;
  }
  void subscribe(Entry& entry) {
    entry.channel->new_subscriber(kNoLimit, &on_core_message, &entry);
  }

  /// The node is in the middle of its pull_packet(): what follows from it waits until that returns.
  static void on_core_sent(void* context) {
    auto* entry = static_cast<Entry*>(context);
    entry->station->sent_ = entry;
  }
  /// Here the way out turns: the hub tells the program that its message has left, and hands the
  /// channel's next one to the node, so that it can leave in the same frame and at the same time.
  void tell_sent(Entry& entry) {
    entry.has_sent = true;
    set_sending(entry, false);
    note_left(entry);
    user_.on_sent(*this, entry.number);
  }
  /// Beacons tell of its last message from now on.
  void note_left(Entry& entry) {
    if (P::kMessageBits != 32) return;
    if (entry.left == nullptr) entry.left = &left_.of(entry.number);
    *entry.left = numbers_[entry.number];
  }
  static void on_core_message(void* context, const std::uint8_t* bytes, std::uint16_t size,
                              const core::Reception<P>& reception) {
    static_cast<Entry*>(context)->station->hand_up(bytes, size, reception);
  }
  bool is_listening(std::uint16_t channel) const {
    const std::unique_ptr<Entry>* const entry = entries_.find(channel);
    return entry != nullptr && *entry != nullptr && (*entry)->is_listening;
  }
  void hand_up(const std::uint8_t* bytes, std::uint16_t size, const core::Reception<P>& reception);
  Range range_of(const drivers::FrameReception& frame) const;
  const Range& range_once(const drivers::FrameReception& frame) {
    return range_.of(frame, [this](const auto& each) { return range_of(each); });
  }

  std::string name_;
  ProfileName profile_;
  NodeIdentity& identity_;
  const PoseKeeper& poses_;
  StationUser& user_;
  NumberTable<std::unique_ptr<Entry>> entries_;  // open channels
  NumberTable<std::uint32_t> numbers_;           // last message sent on a channel
  int sending_ = 0;                              // channels with a message that has not left
  LastMessages left_;
  std::unique_ptr<Node> node_;                      // megabytes, most of them untouched
  std::vector<std::uint8_t> crossing_;              // reused
  const drivers::FrameReception* frame_ = nullptr;  // in which the packet in hand came
  Entry* sent_ = nullptr;                           // whose message the pull in hand ended
  StationClock clock_;
  RangeOnce range_;  // of its transmitter
  std::uint64_t bad_origins_ = 0;
  bool is_namesake_told_ = false;  // of the frame in hand
  Neighbours neighbours_;
  [[no_unique_address]] Repairing<P> repairing_;
  Hearing hearing_;
  std::unique_ptr<drivers::Link> link_;  // last: it calls the others until it is gone
};

template <class P>
Range NodeStation<P>::range_of(const drivers::FrameReception& frame) const {
  if (frame.distance_m) {
    return {*frame.distance_m, std::numeric_limits<float>::quiet_NaN()};
  }
  if (!frame.pose || !poses_.is_usable(*frame.pose)) return Range::unknown();
  return range_to(poses_.valid(loop::now()), frame.pose);
}

template <class P>
void NodeStation<P>::on_packet(std::span<const std::uint8_t> packet,
                               const drivers::FrameReception& frame) {
  const Range& range = range_once(frame);
  if (!hearing_.takes(frame, range)) return;
  const auto collisions = node_->counters().id_collisions;
  frame_ = &frame;
  clock_.hold(frame.received_at);
  const core::Error result =
      node_->on_packet(packet.data(), static_cast<std::uint16_t>(packet.size()),
                       sensing_of<typename P::Sensing>(range_.last()));
  if (Repairing<P>::concerns(packet)) {
    repairing_.receive(
        packet, result, identity_, [this](std::uint16_t channel) { return is_listening(channel); },
        [&](std::span<const std::uint8_t> known) { on_packet(known, frame); });
    if (!repairing_.is_idle()) link_->wake();
  }
  frame_ = nullptr;
  clock_.release();
  if (node_->has_packet()) link_->wake();  // one to forward
  if (node_->counters().id_collisions == collisions) return;
  is_namesake_told_ = true;
  user_.on_namesake(*this);
}

template <class P>
void NodeStation<P>::on_frame(const drivers::FrameReception& frame) {
  const Range range = range_once(frame);
  range_.end();
  const auto found = neighbours_.heard(frame, range, hearing_.is_out_of_range(range));
  if (found.older != nullptr) user_.on_duplicate(*this, *found.older, *found.younger);
  if (found.double_of_us != nullptr) user_.on_double_address(*this, *found.double_of_us);
  const bool is_told = std::exchange(is_namesake_told_, false);
  const bool is_namesake =
      frame.transmitter == identity_.id() && frame.transmitter_epoch != identity_.epoch();
  if (is_namesake && !is_told) user_.on_namesake(*this);
}

template <class P>
void NodeStation<P>::on_last_message(const frame::LastMessage& last,
                                     const drivers::FrameReception& frame) {
  if (P::kMessageBits != 32 || !hearing_.takes_beacon(frame, range_of(frame))) return;
  MessageHead head;
  head.channel = last.channel;
  head.sender = frame.transmitter;
  head.epoch = frame.transmitter_epoch & 0xFFFFu;  // as a packet carries it
  head.number = last.number;
  head.received_at_ns = nanoseconds(frame.received_at);
  head.has_wide_number = true;
  head.drops = {frame.kernel_drops, node_->counters().no_memory};
  user_.on_last_message(*this, head);
}

template <class P>
void NodeStation<P>::hand_up(const std::uint8_t* bytes, std::uint16_t size,
                             const core::Reception<P>& reception) {
  std::span<const std::uint8_t> payload(bytes, size);
  MessageHead head;
  head.crossed_gateway =
      reception.crossed_gateway ||
      (!kLimits.marks_gateways && kLimits.first_gateway_id <= std::uint16_t{reception.node});
  if (reception.crossed_gateway) {
    head.origin = take_origin(payload);
    if (!head.origin) {
      ++bad_origins_;
      return;
    }
  }
  head.channel = reception.channel;
  head.sender = reception.node;
  head.epoch = reception.epoch;
  head.number = reception.message;
  head.distance_m = range_.last().distance_m;
  head.bearing_rad = range_.last().bearing_rad;
  head.sender_pose = frame_->pose;
  head.hops = hops_of(reception, frame_->transmitter);
  if (frame_->transmitter != reception.node) head.transmitter = frame_->transmitter;
  head.ttl = reception.ttl;
  head.received_at_ns = nanoseconds(frame_->received_at);
  head.has_wide_number = P::kMessageBits == 32;
  head.drops = {frame_->kernel_drops, node_->counters().no_memory};
  head.buffering_delay_us = delay_us(reception);
  head.is_time_known = frame_->is_time_known;
  user_.on_message(*this, head, payload);
}

template <class P>
drivers::Counters NodeStation<P>::counters() const {
  drivers::Counters counters = node_counters<P>(node_->counters(), repairing_.received());
  counters.insert(counters.end(), {{"node_forwards_too_late", node_->forwards_too_late()},
                                   {"node_bad_origins", bad_origins_},
                                   {"neighbours_evicted", neighbours_.evicted()}});
  hearing_.add_counters(counters);
  repairing_.add_counters(counters);
  return counters;
}

}  // namespace swarmtalk::daemon
