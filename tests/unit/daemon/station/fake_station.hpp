// Fakes for the daemon's tests: a link that a test plays by hand, a station that remembers what it
// was given, and a hub's client that remembers what it was told.
#pragma once

#include <algorithm>
#include <cstring>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "daemon/hub/hub_client.hpp"
#include "daemon/station/station.hpp"
#include "drivers/link/frame_tap.hpp"

namespace swarmtalk::daemon {

class FakeLink final : public drivers::Link, public drivers::Tappable {
 public:
  void start(drivers::LinkUser& user) override { user_ = &user; }
  void wake() override { ++wakes; }
  std::size_t packet_limit_bytes() const override { return packet_limit; }
  std::string missing() const override { return misses; }
  bool is_up() const override { return up; }
  std::string state() const override { return up ? "up" : "interface fake0 is gone"; }
  std::string type() const override { return "fake"; }
  std::string device() const override { return "fake0"; }
  drivers::Counters counters() const override { return counts; }
  drivers::LinkSettings settings() const override { return link_settings; }
  void set_key(std::shared_ptr<const frame::SwarmKey> to) override { key = std::move(to); }
  void set_pacing(const drivers::PacerConfig& to) override { pacing = to; }
  void set_tap(drivers::FrameTap* to) override { tap = to; }
  std::string hardware_text(std::uint64_t hardware) const override {
    return "address " + std::to_string(hardware);
  }
  drivers::Signals signals() override { return strengths; }

  /// Every packet that waits.
  std::vector<std::vector<std::uint8_t>> pull_all() {
    std::vector<std::vector<std::uint8_t>> packets;
    std::vector<std::uint8_t> out(1400);
    while (const std::size_t size = user_->pull_packet(out)) {
      packets.emplace_back(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size));
    }
    return packets;
  }
  void hand_up(const std::vector<std::uint8_t>& packet, const drivers::FrameReception& frame) {
    user_->on_packet(packet, frame);
    user_->on_frame(frame);
  }
  drivers::LinkUser& user() { return *user_; }

  bool up = true;
  std::string misses;
  std::size_t packet_limit = SIZE_MAX;
  int wakes = 0;
  drivers::Counters counts{{"frames_sent", 42}};
  drivers::LinkSettings link_settings;
  std::shared_ptr<const frame::SwarmKey> key;
  drivers::PacerConfig pacing;
  drivers::FrameTap* tap = nullptr;
  drivers::Signals strengths;

 private:
  drivers::LinkUser* user_ = nullptr;
};

class FakeStation final : public Station {
 public:
  struct Sent {
    std::uint16_t channel;
    std::string payload;
    std::uint8_t ttl;
    bool operator==(const Sent&) const = default;
  };

  explicit FakeStation(StationUser& user, std::string name = "fake", std::uint16_t id = 5)
      : own_identity(id), user_(user), name_(std::move(name)) {}

  void start() override {}

  const std::string& name() const override { return name_; }
  const char* profile() const override { return "fake"; }
  NodeIdentity& identity() override { return identity_in_use ? *identity_in_use : own_identity; }
  const StationLimits& limits() const override { return station_limits; }
  bool is_up() const override { return link_.up; }
  std::size_t message_bytes_that_fit(bool is_timestamped) const override {
    return is_timestamped ? fits - 4 : fits;
  }
  drivers::Link& link() override { return link_; }
  drivers::Counters counters() const override { return {{"node_messages_sent", 43}}; }
  std::vector<Neighbour> neighbours(Neighbour::Time) const override { return around; }

  bool open_channel(std::uint16_t channel, bool) override {
    if (open.size() >= capacity) return false;
    open.insert(channel);
    return true;
  }
  void close_channel(std::uint16_t channel) override { open.erase(channel); }
  void set_listening(std::uint16_t channel, bool is_listening) override {
    if (is_listening) {
      listening.insert(channel);
    } else if (listening.erase(channel) > 0 && busy.count(channel) == 0) {
      kept.erase(channel);
    }
  }
  SendResult send(std::uint16_t channel, std::span<const std::uint8_t> payload, std::uint8_t ttl,
                  const GatewayOrigin* origin, std::uint64_t waited_us,
                  std::uint32_t& number) override {
    if (busy.count(channel) > 0) return SendResult::kBusy;
    if (refuses) return SendResult::kRefused;
    busy.insert(channel);
    sent.push_back({channel, std::string(payload.begin(), payload.end()), ttl});
    last_waited_us = waited_us;
    origins.push_back(origin == nullptr ? std::nullopt : std::optional<GatewayOrigin>(*origin));
    number = last_number = std::max(number, last_number + 1);
    return SendResult::kSent;
  }
  bool send_again(std::uint16_t channel) override {
    if (busy.count(channel) > 0 || kept.count(channel) == 0) return false;
    busy.insert(channel);
    sent.push_back(sent.back());
    return true;
  }
  bool has_redundancy() const override { return repairs; }
  void protect_next(std::uint8_t wanted) override { protections.push_back(wanted); }
  void cancel(std::uint16_t channel) override { busy.erase(channel); }
  void set_virtual_range(const VirtualRange& to) override { virtual_range = to; }
  void set_ghosts(bool are_heard) override { hears_ghosts = are_heard; }
  void adopt_node_id() override { node_id = identity().id(); }

  /// The last packet of what was sent last on this channel has left.
  void leave(std::uint16_t channel) {
    busy.erase(channel);
    kept.insert(channel);
    user_.on_sent(*this, channel);
  }
  void receive(const MessageHead& head, const std::string& payload) {
    user_.on_message(*this, head,
                     {reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size()});
  }
  void set_up(bool up) { link_.up = up; }

  std::size_t capacity = 64;
  bool refuses = false;
  bool repairs = false;                   // it has redundancy
  std::vector<std::uint8_t> protections;  // that were asked for
  std::size_t fits = 1000;
  std::set<std::uint16_t> open, listening, busy;
  std::set<std::uint16_t> kept;  // channels whose last message can be sent again: as core has it
  std::vector<Neighbour> around;
  std::vector<Sent> sent;
  std::vector<std::optional<GatewayOrigin>> origins;  // of what was sent
  NodeIdentity own_identity;
  NodeIdentity* identity_in_use = nullptr;  // none: its own
  StationLimits station_limits{100, 1000, 996, 15, 65535};
  std::uint32_t last_number = 0;
  std::uint64_t last_waited_us = 0;
  std::uint16_t node_id = 0;
  VirtualRange virtual_range;
  bool hears_ghosts = true;

 private:
  StationUser& user_;
  std::string name_;
  FakeLink link_;
};

/// For what is tested without a hub above its stations.
class DeafUser final : public StationUser {
 public:
  void on_message(Station&, const MessageHead&, std::span<const std::uint8_t>) override {}
  void on_sent(Station&, std::uint16_t) override {}
  void on_namesake(Station&) override {}
};

class FakeClient final : public HubClient {
 public:
  void on_message(Subscription& subscription, const MessageRef& message) override {
    heard.emplace_back(subscription.id, message->payload, message->is_local);
    last = message;
  }
  void on_sent(Publisher&, std::uint64_t number) override { sent.push_back(number); }
  void on_unsent(std::uint32_t, std::uint64_t number, const Refusal& refusal) override {
    unsent.emplace_back(number, refusal.code);
  }

  std::vector<std::tuple<std::uint32_t, std::string, bool>> heard;
  std::vector<std::uint64_t> sent;
  std::vector<std::pair<std::uint64_t, ipc::ErrorCode>> unsent;
  MessageRef last;
};

}  // namespace swarmtalk::daemon
