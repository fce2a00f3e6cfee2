// Hub: where messages meet, and the only place where ways cross; it knows stations and sessions by
// their interfaces and does no I/O. It puts its parts together: ChannelRegistry (which channel is
// open where), Admission (what can be sent at all), Outbox (what has not left yet), Gateways (what
// is copied to another link) and Delivery (what subscriptions hear).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/common/log_limiter.hpp"
#include "daemon/config/config.hpp"
#include "daemon/hub/admission.hpp"
#include "daemon/hub/channel_registry.hpp"
#include "daemon/hub/channel_table.hpp"
#include "daemon/hub/delivery.hpp"
#include "daemon/hub/gateways.hpp"
#include "daemon/hub/hub_client.hpp"
#include "daemon/hub/outbox.hpp"
#include "daemon/hub/station_list.hpp"
#include "daemon/station/node_identity.hpp"
#include "daemon/station/station.hpp"

namespace swarmtalk::daemon {

class Hub final : public StationUser, private OutgoingListener {
 public:
  using Time = Outbox::Time;

  Hub(ChannelTable& names, const LimitsConfig& limits, DaemonCounters& counters,
      NodeIdentity& identity);
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  /// Before any session. The station must outlive the hub's use.
  void add(Station& station) { stations_.add(station); }
  const StationList& stations() const { return stations_; }

  /// After every station, before any session. Links are counted in the order of add(). Opens the
  /// channels of the rules for good.
  /// @return what is impossible; none: done
  std::optional<Refusal> set_gateways(std::vector<GatewayRule> rules) {
    return gateways_.set_rules(std::move(rules));
  }

  /// Messages that no link has taken yet.
  std::size_t waiting_messages() const { return outbox_.waiting_for_room().messages; }

  /// Which channels are reserved, and whether they are on. Again when names of channels change.
  void set_reserved(const ReservedConfig& config, const std::string& how_to_change) {
    admission_.set_reserved(config, how_to_change);
  }

  // Each returns none when done. Pointers are kept until the opposite call.
  std::optional<Refusal> subscribe(const ChannelRequest& request, Subscription& subscription);
  void unsubscribe(Subscription& subscription);
  std::optional<Refusal> advertise(const ChannelRequest& request, Publisher& publisher);
  void unadvertise(Publisher& publisher);

  /// Accepts a message: on_sent() or on_unsent() of the client follows exactly once. One that is
  /// refused because no link is up is heard by the programs of this robot.
  /// @param sent_at_ns  monotonic, when the app sent it; none or in the future: now
  std::optional<Refusal> publish(Publisher& publisher, std::uint64_t number,
                                 std::string_view payload, std::optional<std::uint32_t> ttl,
                                 std::optional<std::uint64_t> sent_at_ns = std::nullopt);

  /// Hands a message to this robot's programs alone: nothing goes on the air.
  void tell_programs(const Publisher& publisher, std::string_view payload);

  /// Sends the copies of important messages that are due. Call when the time has come that the hook
  /// told last.
  void send_copies(Time now) { outbox_.send_copies(now); }
  /// Called with the time of the next copy, whenever that changes to an earlier one. Must be cheap.
  void set_copy_hook(std::function<void(Time)> hook) { outbox_.set_copy_hook(std::move(hook)); }

  /// What every station that has this channel can carry on it.
  ChannelLimits limits(std::uint16_t channel) const { return channels_.limits(channel); }

  /// Why nothing comes from other robots on this channel now. None: a link that carries it is up,
  /// or no link does.
  std::optional<Refusal> links_down(std::uint16_t channel) const {
    return channels_.links_down(channel);
  }

  /// Messages of a program for this channel that were not taken, here or in the program itself.
  void note_refused(std::uint16_t channel, std::uint64_t messages) {
    if (Channel* known = channels_.find(channel)) known->refused += messages;
  }

  /// Gives up what waits for stations that are down. Call about once a second while messages wait.
  /// @return whether some still do
  bool give_up_on_dead_links() { return outbox_.give_up_on_dead_links(); }

  /// Called whenever a message begins to wait where none did. Must be cheap.
  void set_waiting_hook(std::function<void()> hook) { outbox_.set_waiting_hook(std::move(hook)); }

  Shares& shares() { return shares_; }
  const Shares& shares() const { return shares_; }

  /// From now on every station without an id of its own speaks under this one.
  /// @param fixed  1..65534; none: automatic
  /// @return why not: a link's packets have no room for it
  std::optional<Refusal> set_node_id(std::optional<std::uint16_t> fixed);

  /// Channels in use, by number.
  std::vector<ChannelView> channels() const { return channels_.views(); }

  void on_message(Station& station, const MessageHead& head,
                  std::span<const std::uint8_t> payload) override;
  void on_sent(Station& station, std::uint16_t channel) override {
    outbox_.on_sent(stations_.index_of(station), channel);
  }
  void on_namesake(Station& station) override;
  void on_last_message(Station& station, const MessageHead& head) override;
  void on_link_state(Station& station) override;
  void on_duplicate(Station& station, const Neighbour& older, const Neighbour& younger) override;
  void on_double_address(Station& station, const Neighbour& other) override;

 private:
  std::optional<Refusal> check_share(const ChannelRequest& request, const HubClient& client,
                                     Shares::End end);
  std::optional<Refusal> tell_users(std::optional<Refusal> refusal,
                                    const ChannelRequest& request) const;
  void on_outgoing(const Publication& publication, std::size_t station, Channel& channel,
                   std::uint32_t number) override;
  void on_stayed_here(const Publication& publication, Channel& channel) override;
  void deliver_here(const PublicationHead& publication, Channel& channel,
                    std::span<const std::uint8_t> payload);
  MessageHead own_head(const Channel& channel) const;

  DaemonCounters& counters_;
  NodeIdentity& identity_;
  LogLimiter namesake_log_;
  LogLimiter duplicate_log_;
  LogLimiter address_log_;
  StationList stations_;
  ChannelRegistry channels_;
  Shares shares_;
  Admission admission_;
  Outbox outbox_;
  Gateways gateways_;
  Delivery delivery_;
};

}  // namespace swarmtalk::daemon
