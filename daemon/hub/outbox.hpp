// Outbox: what has been accepted and has not left yet. Takes publications to every station that
// carries their channel, one message per channel and station at a time and publishers in turn;
// tells each publisher what became of its message. On the daemon's thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/hub/channel_registry.hpp"
#include "daemon/hub/copy_schedule.hpp"
#include "daemon/hub/publication.hpp"
#include "daemon/hub/station_list.hpp"

namespace swarmtalk::daemon {

/// Who hears what this robot itself sends. Called in the middle of the outbox's work.
class OutgoingListener {
 public:
  virtual ~OutgoingListener() = default;
  /// The first station has taken a message. Once for each. May add copies of it to the outbox.
  /// @param number  that it has there
  virtual void on_outgoing(const Publication& publication, std::size_t station, Channel& channel,
                           std::uint32_t number) = 0;
  /// No station could take a program's message.
  virtual void on_stayed_here(const Publication& publication, Channel& channel) = 0;
};

class Outbox {
 public:
  using Time = CopySchedule::Time;

  /// All references must outlive it.
  Outbox(const StationList& stations, ChannelRegistry& channels, DaemonCounters& counters,
         OutgoingListener& listener)
      : stations_(stations), channels_(channels), counters_(counters), listener_(listener) {}

  /// Takes a message on: on_sent() or on_unsent() of the client follows exactly once. When the
  /// publisher's queue is full, its oldest is dropped. @pre admitted
  /// @param sent_at_ns  monotonic, when the app sent it; none: now
  void publish(Publisher& publisher, Channel& channel, std::uint64_t number,
               std::string_view payload, std::uint8_t ttl, std::optional<std::uint64_t> sent_at_ns);

  /// Takes on a copy that a gateway rule makes, for the rule's link. Of the rule's copies that wait
  /// there too long a queue loses its oldest. The rule must outlive it.
  void copy(const GatewayRule& rule, Channel& channel, std::span<const std::uint8_t> payload,
            GatewayOrigin origin, std::uint8_t ttl);

  /// The publisher is going: what was taken on for it leaves without it, in order.
  void withdraw(Publisher& publisher);

  /// The last packet of the message in flight there has left. The next one starts in here.
  void on_sent(std::size_t station, std::uint16_t channel);

  /// Sends the copies of important messages that are due. Call when the time has come that the hook
  /// told last.
  void send_copies(Time now);
  void set_copy_hook(std::function<void(Time)> hook) { copies_.set_hook(std::move(hook)); }

  /// Gives up what waits for stations that are down. @return whether some still waits
  bool give_up_on_dead_links();

  /// Called whenever a message begins to wait where none did. Must be cheap.
  void set_waiting_hook(std::function<void()> hook) { waiting_hook_ = std::move(hook); }

  /// Accepted, not finished.
  std::uint32_t waiting() const { return waiting_; }
  Waiting waiting_for_room() const { return {waiting_ - parked_, waiting_bytes_}; }

 private:
  void take_on(Publication& publication, Channel& channel);
  void settle(Publication& publication, Channel& channel);
  void park(Publication& publication);
  void unpark(Slot& slot);
  void start(Publication& publication, Channel& channel);
  void start_next(Publisher& publisher, Channel& channel);
  void drop_oldest(Publisher& publisher, Channel& channel);
  void forget_departed(const Publisher& heir);
  void make_room(const GatewayRule& rule, Channel& channel);
  void feed(std::size_t station, Channel& channel);
  bool wait_for_copy(std::size_t station, Channel& channel, Slot& slot);
  void finish(Publication& publication, Channel& channel, bool was_sent);
  void count_copy(const Publication& publication);

  const StationList& stations_;
  ChannelRegistry& channels_;
  DaemonCounters& counters_;
  OutgoingListener& listener_;
  PublicationPool pool_;
  CopySchedule copies_;
  std::list<Publisher> departed_;  // without a client: what those that went have left behind
  std::uint32_t given_up_ = 0;     // of them, since the last log line
  std::uint32_t waiting_ = 0;
  std::uint32_t parked_ = 0;  // of them: wait for their next copy's time
  std::uint64_t waiting_bytes_ = 0;
  std::function<void()> waiting_hook_ = [] {};
};

}  // namespace swarmtalk::daemon
