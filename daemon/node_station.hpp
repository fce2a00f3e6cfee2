// NodeStation: a Station on a core node of profile P. It owns the link, answers its pulls from the
// node, measures distance and bearing of what it hears, and turns the node's callbacks into calls
// of the hub.
#pragma once

#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <unordered_map>
#include <utility>

#include "daemon/node_identity.hpp"
#include "daemon/pose_keeper.hpp"
#include "daemon/ranging.hpp"
#include "daemon/station.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::daemon {

/// Which profile's packets a station speaks, for frames and for people.
struct ProfileName {
  frame::ProfileId id;
  const char* text;
};

template <class P>
class NodeStation final : public Station, public drivers::LinkUser {
 public:
  /// All references must outlive the station. @param link  not yet started
  NodeStation(std::string name, ProfileName profile, std::unique_ptr<drivers::Link> link,
              const NodeIdentity& identity, const PoseKeeper& poses, StationUser& user)
      : name_(std::move(name)),
        profile_(profile),
        identity_(identity),
        poses_(poses),
        user_(user),
        node_(std::make_unique<Node>(core::Port{&clock_us, &random, this})),
        link_(std::move(link)) {
    node_->set_node_id(identity.id());
    node_->set_epoch(static_cast<std::uint16_t>(identity.epoch()));
  }

  /// After every privilege is dropped.
  void start() { link_->start(*this); }

  const std::string& name() const override { return name_; }
  const char* profile() const override { return profile_.text; }
  const StationLimits& limits() const override { return kLimits; }
  bool is_up() const override { return link_->is_up(); }
  std::size_t message_bytes_that_fit(bool is_timestamped) const override {
    const std::size_t packet_bytes = link_->packet_limit_bytes();
    if (packet_bytes >= W::kMtuBytes) {
      return is_timestamped ? kLimits.max_timestamped_message_bytes : kLimits.max_message_bytes;
    }
    // All packets of a message but the last are of the profile's full length, so only a message of
    // one packet fits.
    const std::size_t around =
        W::kHeaderBytes + W::kChecksumBytes + (is_timestamped ? W::kTimestampBytes : 0);
    return packet_bytes < around ? 0 : packet_bytes - around;
  }
  drivers::Link& link() override { return *link_; }
  drivers::Counters counters() const override;

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
    const auto found = entries_.find(number);
    node_->remove_channel(found->second->channel);
    entries_.erase(found);
  }

  void set_listening(std::uint16_t number, bool is_listening) override {
    Entry& entry = *entries_.at(number);
    if (entry.is_listening == is_listening) return;
    entry.is_listening = is_listening;
    if (is_listening) {
      subscribe(entry);
    } else if (!entry.channel->is_busy()) {
      reattach(entry);  // core has no other way to unsubscribe; when busy, the hub drops the rest
    }
  }

  SendResult send(std::uint16_t number, std::span<const std::uint8_t> payload, std::uint8_t ttl,
                  std::uint64_t waited_us, std::uint32_t& message_number) override {
    Entry& entry = *entries_.at(number);
    const auto waited =
        static_cast<Ticks>(std::min<std::uint64_t>(waited_us, std::numeric_limits<Ticks>::max()));
    const core::Error error = entry.channel->publish(
        payload.data(), static_cast<std::uint16_t>(payload.size()), ttl, false, waited);
    if (error == core::Error::kBusy) return SendResult::kBusy;
    if (error != core::Error::kOk) return SendResult::kRefused;
    message_number = ++numbers_[number];
    link_->wake();
    return SendResult::kSent;
  }

  bool send_again(std::uint16_t number) override {
    if (entries_.at(number)->channel->send_again() != core::Error::kOk) return false;
    link_->wake();
    return true;
  }

  void cancel(std::uint16_t number) override {
    Entry& entry = *entries_.at(number);
    if (!entry.channel->is_busy()) return;
    // Nobody has heard of the number: skipping it would look like a loss.
    if (entry.channel->is_unbegun() && numbers_[number] > 0) --numbers_[number];
    reattach(entry);
  }

  void set_node_id(std::uint16_t node_id) override { node_->set_node_id(node_id); }

  // LinkUser
  std::size_t pull_packet(std::span<std::uint8_t> out) override {
    return out.size() < node_->next_packet_bytes() ? 0 : node_->pull_packet(out.data());
  }
  std::size_t next_packet_bytes() override { return node_->next_packet_bytes(); }
  void on_packet(std::span<const std::uint8_t> packet,
                 const drivers::FrameReception& frame) override;
  frame::FrameHeader frame_header() override {
    frame::FrameHeader header;
    header.profile = profile_.id;
    header.node = identity_.id();
    header.epoch = identity_.epoch();
    header.pose = poses_.on_air(std::chrono::steady_clock::now());
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
    core::Channel<P>* channel = nullptr;
    core::Publisher<P>* publisher = nullptr;
  };

  static constexpr StationLimits kLimits{W::kMtuBytes, W::kMessageBytes, W::kTimedMessageBytes,
                                         W::kTtlMax, W::kChannelMax};
  static constexpr float kNoLimit = std::numeric_limits<float>::infinity();

  static std::uint32_t clock_us(void* station) {
    return static_cast<NodeStation*>(station)->now_us();
  }
  /// While a packet is being received, the time when the kernel took it: what it waited for us then
  /// counts in its delay. Never goes back, as a node's clock must not.
  std::uint32_t now_us() {
    const auto now = frame_ != nullptr ? frame_->received_at : std::chrono::steady_clock::now();
    latest_ = std::max(latest_, now);
    return static_cast<std::uint32_t>(
        std::chrono::duration_cast<std::chrono::microseconds>(latest_.time_since_epoch()).count());
  }
  static std::uint32_t random(void*) { return random_bits(); }

  bool attach(Entry& entry) {
    // TTL 0: each message brings its own.
    entry.channel = node_->new_channel(entry.number, 0, entry.is_timestamped);
    if (entry.channel == nullptr) return false;
    // From another place in the node its count might begin elsewhere: a gap that is no loss.
    if (P::kMessageBits == 32) {
      entry.channel->continue_after(static_cast<typename W::MessageNumber>(numbers_[entry.number]));
    }
    entry.publisher = entry.channel->new_publisher(&on_core_sent, &entry);
    if (entry.is_listening) subscribe(entry);
    return true;
  }
  void reattach(Entry& entry) {
    node_->remove_channel(entry.channel);
    attach(entry);  // into the slot that has just become free
  }
  void subscribe(Entry& entry) {
    entry.channel->new_subscriber(kNoLimit, &on_core_message, &entry);
  }

  static void on_core_sent(void* context) {
    auto* entry = static_cast<Entry*>(context);
    entry->station->user_.on_sent(*entry->station, entry->number);
  }
  static void on_core_message(void* context, const std::uint8_t* bytes, std::uint16_t size,
                              const core::Reception<P>& reception) {
    static_cast<Entry*>(context)->station->hand_up(bytes, size, reception);
  }
  void hand_up(const std::uint8_t* bytes, std::uint16_t size, const core::Reception<P>& reception);

  std::string name_;
  ProfileName profile_;
  const NodeIdentity& identity_;
  const PoseKeeper& poses_;
  StationUser& user_;
  std::unordered_map<std::uint16_t, std::unique_ptr<Entry>> entries_;
  std::unordered_map<std::uint16_t, std::uint32_t> numbers_;  // last message sent on a channel
  std::unique_ptr<Node> node_;                                // megabytes, most of them untouched
  const drivers::FrameReception* frame_ = nullptr;            // in which the packet in hand came
  drivers::MonotonicTime latest_{};                           // that the node was told
  std::unique_ptr<drivers::Link> link_;  // last: it calls the others until it is gone
};

template <class P>
void NodeStation<P>::on_packet(std::span<const std::uint8_t> packet,
                               const drivers::FrameReception& frame) {
  const auto now = std::chrono::steady_clock::now();
  const bool is_usable = frame.pose && poses_.is_usable(*frame.pose);
  const Range range =
      range_to(poses_.valid(now), is_usable ? frame.pose : std::optional<frame::FramePose>());
  const auto collisions = node_->counters().id_collisions;
  frame_ = &frame;
  node_->on_packet(packet.data(), static_cast<std::uint16_t>(packet.size()),
                   {range.distance_m, range.bearing_rad, 0});
  frame_ = nullptr;
  if (node_->has_packet()) link_->wake();  // one to forward
  const bool is_namesake =
      frame.transmitter == identity_.id() && frame.transmitter_epoch != identity_.epoch();
  if (is_namesake || node_->counters().id_collisions != collisions) user_.on_namesake(*this);
}

template <class P>
void NodeStation<P>::hand_up(const std::uint8_t* bytes, std::uint16_t size,
                             const core::Reception<P>& reception) {
  using std::chrono::duration_cast;
  const auto stamp = frame_->received_at.time_since_epoch();
  MessageHead head;
  head.channel = reception.channel;
  head.sender = reception.node;
  head.epoch = reception.epoch;
  head.number = reception.message;
  head.distance_m = reception.sensing.distance_m;
  head.bearing_rad = reception.sensing.bearing_rad;
  head.sender_pose = frame_->pose;
  head.hops = reception.hops;
  head.ttl = reception.ttl;
  head.received_at_ns =
      static_cast<std::uint64_t>(duration_cast<std::chrono::nanoseconds>(stamp).count());
  head.has_wide_number = P::kMessageBits == 32;
  head.drops = {frame_->kernel_drops, node_->counters().no_memory};
  // Until the kernel's stamp; what has passed since, whoever hands the message on adds.
  if (reception.has_delay) head.buffering_delay_us = reception.delay_ticks;
  head.is_time_known = frame_->is_time_known;
  user_.on_message(*this, head, {bytes, size});
}

template <class P>
drivers::Counters NodeStation<P>::counters() const {
  const core::Counters<P>& c = node_->counters();
  return {
      {"node_packets_forwarded", c.packets_forwarded},
      {"node_messages_sent", c.messages_sent},
      {"node_messages_received", c.messages_received},
      {"node_bad_packets", c.bad_packets},
      {"node_bad_checksums", c.bad_checksums},
      {"node_unknown_channels", c.unknown_channels},
      {"node_duplicates", c.duplicates},
      {"node_own_echoes", c.own_echoes},
      {"node_forward_queue_full", c.forward_queue_full},
      {"node_no_memory", c.no_memory},
      {"node_aged_out", c.aged_out},
      {"node_contradictions", c.contradictions},
      {"node_id_collisions", c.id_collisions},
  };
}

}  // namespace swarmtalk::daemon
