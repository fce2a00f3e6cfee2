// Hub: where messages meet. Takes publications from sessions to every station whose link is up, one
// message per channel and station at a time and publishers in turn; takes received messages to the
// subscriptions. The only place where ways cross; it knows stations and sessions by their
// interfaces and does no I/O.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/common/log_limiter.hpp"
#include "daemon/common/number_table.hpp"
#include "daemon/common/token_bucket.hpp"
#include "daemon/config/config.hpp"
#include "daemon/hub/channel_table.hpp"
#include "daemon/hub/hub_client.hpp"
#include "daemon/hub/loss_tracker.hpp"
#include "daemon/hub/seen_messages.hpp"
#include "daemon/station/node_identity.hpp"
#include "daemon/station/station.hpp"

namespace swarmtalk::daemon {

/// What is known of one accepted message on its way out, without its bytes.
struct PublicationHead {
  Publisher* owner = nullptr;  // none: the client is gone; the message leaves all the same
  std::uint64_t client = 0;    // serial of who must not hear it, gone or not; 0: nobody
  std::uint64_t number = 0;    // the client's
  std::uint8_t ttl = 0;
  std::uint64_t sent_at_ns = 0;  // monotonic: when the app called send()
  std::uint32_t copies = 1;
  std::uint32_t copy_interval_ms = 0;
  std::uint32_t pending = 0;     // stations that have not sent it
  std::uint32_t sent = 0;        // stations that have
  std::uint32_t air_number = 0;  // on all links; 0: each counts by itself
  bool is_heard_locally = false;
  // Of a copy that a gateway rule makes: it has no owner.
  const GatewayRule* rule = nullptr;
  std::optional<GatewayOrigin> origin;
  bool is_replaced = false;  // by a newer copy
  std::uint64_t serial = 0;  // of all publications: the memory is used again, this is not
};

/// It lives until every station that took it is done with it; its memory is used again.
struct Publication : PublicationHead {
  std::string payload;
};

class Hub final : public StationUser {
 public:
  struct Limits {
    std::uint16_t message_bytes = 0;
    std::uint8_t ttl = 0;
    std::uint16_t least_message_bytes = 0;
    bool is_timestamped = false;
  };
  struct ChannelView {
    std::uint16_t number;
    std::string name;
    std::uint32_t publishers;
    std::uint32_t subscribers;
    bool is_timestamped;
    std::vector<std::string> links;  // that carry it
    std::uint64_t received;
    Loss lost;
  };

  Hub(ChannelTable& names, const LimitsConfig& limits, DaemonCounters& counters,
      NodeIdentity& identity);
  ~Hub() override;

  /// Before any session. The station must outlive the hub's use.
  void add(Station& station);
  const std::vector<Station*>& stations() const { return stations_; }

  /// After every station, before any session. Links are counted in the order of add(). Opens the
  /// channels of the rules for good.
  /// @return what is impossible; none: done
  std::optional<Refusal> set_gateways(std::vector<GatewayRule> rules);

  /// Which channels are reserved, and whether they are on. Again when names of channels change.
  void set_reserved(const ReservedConfig& config);

  // Each returns none when done. Pointers are kept until the opposite call.
  std::optional<Refusal> subscribe(const ChannelRequest& request, Subscription& subscription);
  void unsubscribe(Subscription& subscription);
  std::optional<Refusal> advertise(const ChannelRequest& request, Publisher& publisher);
  void unadvertise(Publisher& publisher);

  /// Accepts a message: on_sent() or on_unsent() of the client follows exactly once.
  /// @param sent_at_ns  monotonic, when the app sent it; none or in the future: now
  std::optional<Refusal> publish(Publisher& publisher, std::uint64_t number,
                                 std::string_view payload, std::optional<std::uint32_t> ttl,
                                 std::optional<std::uint64_t> sent_at_ns = std::nullopt);

  using Time = std::chrono::steady_clock::time_point;
  /// Sends the copies of important messages that are due. Call when the time has come that the hook
  /// told last.
  void send_copies(Time now);
  /// Called with the time of the next copy, whenever that changes to an earlier one. Must be cheap.
  void set_copy_hook(std::function<void(Time)> hook) { copy_hook_ = std::move(hook); }

  /// What every station that has this channel can carry on it.
  Limits limits(std::uint16_t channel) const;

  /// Why nothing comes from other robots on this channel now. None: a link that carries it is up,
  /// or no link does.
  std::optional<Refusal> links_down(std::uint16_t channel) const;

  /// Gives up what waits for stations that are down. Call about once a second while messages wait.
  /// @return whether some still do
  bool give_up_on_dead_links();

  /// Called whenever a message begins to wait where none did. Must be cheap.
  void set_waiting_hook(std::function<void()> hook) { waiting_hook_ = std::move(hook); }

  /// From now on every station without an id of its own speaks under this one.
  /// @param fixed  1..65534; none: automatic
  /// @return why not: a link's packets have no room for it
  std::optional<Refusal> set_node_id(std::optional<std::uint16_t> fixed);

  /// Channels in use, by number.
  std::vector<ChannelView> channels() const;

  void on_message(Station& station, const MessageHead& head,
                  std::span<const std::uint8_t> payload) override;
  void on_sent(Station& station, std::uint16_t channel) override;
  void on_namesake(Station& station) override;
  void on_last_message(Station& station, const MessageHead& head) override;
  void on_link_state(Station& station) override;
  void on_duplicate(Station& station, const Neighbour& older, const Neighbour& younger) override;

 private:
  struct Slot {  // one channel on one station
    Publication* in_flight = nullptr;
    std::vector<Publication*> waiting;  // first come, first sent
    bool is_open = false;
    std::uint32_t copies_left = 0;   // of the one in flight
    bool is_between_copies = false;  // it waits for its next copy's time
    bool has_left = false;           // a copy of it has
    bool is_gateway = false;         // heard for a gateway rule, whoever subscribes
  };
  struct Channel {
    std::uint16_t number = 0;
    bool is_timestamped = false;
    std::uint32_t publishers = 0;
    std::uint32_t publications = 0;  // not yet sent everywhere
    std::vector<Subscription*> subscriptions;
    std::vector<Slot> slots;     // one for each station
    Limits limits;               // of the stations that carry it
    std::uint64_t received = 0;  // from stations, for a subscription
    Loss lost;
    std::uint32_t last_air_number = 0;  // of a publication on several links
    std::uint64_t last_used = 0;        // by use_count_
    bool is_pinned = false;             // of a gateway rule: never evicted

    bool is_idle() const { return publishers == 0 && publications == 0 && subscriptions.empty(); }
    bool has_users() const { return publishers > 0 || !subscriptions.empty(); }
  };

  std::optional<Refusal> use(const ChannelRequest& request, std::string& held_name,
                             Channel*& channel);
  std::optional<Refusal> resolve(const ChannelRequest& request, std::uint16_t& number) const;
  bool default_timestamping(std::uint16_t number) const;
  std::optional<Refusal> check_carried(const ChannelRequest& request, std::uint16_t number,
                                       bool is_timestamped) const;
  std::optional<Refusal> open_anew(Channel& channel, bool is_timestamped);
  Limits limits_of(std::uint16_t channel, bool is_timestamped) const;
  Channel* find(std::uint16_t number) const;
  void erase(std::unordered_map<std::uint16_t, Channel>::iterator channel);
  void listen(Channel& channel);
  std::optional<Refusal> open(Channel& channel);
  void close(Channel& channel);
  bool evict_idle();
  std::optional<Refusal> check(const Publisher& publisher, const Channel& channel,
                               std::size_t size_bytes, std::uint32_t ttl) const;
  static std::optional<Refusal> check_ttl(std::uint32_t ttl, const Limits& most);
  std::optional<Refusal> check_reserved(std::uint16_t channel) const;
  std::optional<Refusal> take_turn(std::uint16_t channel);
  std::optional<Refusal> check_up(const Channel& channel) const;
  std::optional<std::string> down_states(const Channel& channel) const;
  Refusal over_mtu(const Channel& channel, std::size_t size_bytes) const;
  bool carries(std::size_t station, const Channel& channel, std::size_t size_bytes) const;
  bool is_carried(const Channel& channel, std::size_t size_bytes) const;
  void feed(std::size_t station, Channel& channel);
  void start(Publication& publication, Channel& channel);
  void start_next(Publisher& publisher, Channel& channel);
  void drop_queued(Publisher& publisher, Channel& channel, Publication& publication);
  bool wait_for_copy(std::size_t station, Channel& channel, Slot& slot);
  void finish(Publication& publication, Channel& channel, bool was_sent);
  void deliver_locally(Publication& publication, std::size_t station, Channel& channel,
                       std::uint32_t number);
  // hub_gateway.cpp
  std::optional<Refusal> pin(std::uint16_t number, std::size_t listening_station);
  bool came_otherwise(std::size_t station, const MessageHead& head,
                      std::span<const std::uint8_t> payload);
  void cross(std::size_t station, const MessageHead& head, std::span<const std::uint8_t> payload);
  void cross_own(const Publication& publication, const Channel& channel, std::uint32_t number);
  void copy(const GatewayRule& rule, GatewayOrigin origin, std::span<const std::uint8_t> payload,
            std::uint8_t ttl);
  void make_room(const GatewayRule& rule, Channel& channel);
  void count_copy(const Publication& publication);
  void deliver(Channel& channel, const MessageRef& message, std::uint64_t except);
  void note_losses(Channel& channel, const Station& station, const MessageHead& head);
  void note_drops(const Station& station, const DropTotals& drops);
  void add_loss(Channel& channel, const Loss& lost);
  std::size_t index_of(const Station& station) const;
  Publication& new_publication();

  struct Reserved {
    const char* name;
    std::uint16_t number;
    bool is_on;
    std::uint32_t rate_hz;
    TokenBucket turns;
  };

  ChannelTable& names_;
  const LimitsConfig& limits_;
  DaemonCounters& counters_;
  NodeIdentity& identity_;
  LogLimiter namesake_log_;
  LogLimiter duplicate_log_;
  std::vector<Station*> stations_;
  std::unordered_map<std::uint16_t, Channel> channels_;
  NumberTable<Channel*> channels_by_number_;
  MessagePool pool_;
  LossTracker losses_;
  std::vector<DropTotals> station_drops_;                   // by station, as of its message before
  DropTotals drops_;                                        // their sums
  std::vector<std::unique_ptr<Publication>> publications_;  // all there are
  std::vector<Publication*> free_publications_;
  std::uint64_t last_publication_ = 0;  // serial
  std::uint32_t waiting_ = 0;           // accepted, not finished
  std::function<void()> waiting_hook_ = [] {};
  struct DueCopy {
    Time at;
    std::uint16_t channel;
    std::size_t station;
    std::uint64_t publication;  // its serial
  };
  std::vector<DueCopy> due_copies_;  // in no order; a few
  std::function<void(Time)> copy_hook_ = [](Time) {};
  std::uint64_t use_count_ = 0;
  std::vector<GatewayRule> rules_;
  SeenMessages seen_;
  std::vector<Reserved> reserved_;
};

}  // namespace swarmtalk::daemon
