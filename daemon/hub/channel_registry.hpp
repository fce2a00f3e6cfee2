// ChannelRegistry: the channels in use: which number a name means, on which stations a channel is
// open, who listens there, and what its links can carry. It opens channels when they are first used
// and closes idle ones when a station has no room. On the daemon's thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "daemon/common/number_table.hpp"
#include "daemon/hub/channel.hpp"
#include "daemon/hub/channel_table.hpp"
#include "daemon/hub/station_list.hpp"

namespace swarmtalk::daemon {

/// One channel, as the status shows it.
struct ChannelView {
  std::uint16_t number;
  std::string name;
  std::uint32_t publishers;
  std::uint32_t subscribers;
  std::uint32_t onlookers;  // of these
  bool is_timestamped;
  std::vector<std::string> links;  // that carry it
  std::uint64_t received;
  Loss lost;
  std::uint64_t refused;  // messages of programs here that were not taken
};

class ChannelRegistry {
 public:
  /// Both outlive it. No station is added after the first channel.
  ChannelRegistry(ChannelTable& names, const StationList& stations)
      : names_(names), stations_(stations) {}

  /// The number that a request means. @return why there is none
  std::optional<Refusal> resolve(const ChannelRequest& request, std::uint16_t& number) const;

  /// Finds or makes the channel and holds its name for a new subscription or publisher.
  /// @param held_name  to be given to release() @return why not
  std::optional<Refusal> use(const ChannelRequest& request, std::string& held_name,
                             Channel*& channel);
  void release(const Channel& channel, const std::string& held_name) {
    names_.release(channel.number, held_name);
  }

  /// Opens a channel for good. @param listening_station  where it is heard; none beyond the last
  std::optional<Refusal> pin(std::uint16_t number, std::size_t listening_station);

  /// @return null: not in use
  Channel* find(std::uint16_t number) const;
  std::unordered_map<std::uint16_t, Channel>& all() { return channels_; }
  const std::unordered_map<std::uint16_t, Channel>& all() const { return channels_; }

  /// Its subscriptions have changed: stations begin or cease to put its messages together.
  void listen(const Channel& channel);

  /// It is used now: the longest unused idle channel goes first.
  void touch(Channel& channel) { channel.last_used = ++use_count_; }

  /// What every station that has this channel can carry on it.
  ChannelLimits limits(std::uint16_t number) const;

  /// Whether a message of this size can leave on a station now; on any.
  bool carries(std::size_t station, const Channel& channel, std::size_t size_bytes) const;
  bool is_carried(const Channel& channel, std::size_t size_bytes) const;

  /// Of the links that carry the channel. @return none: one of them is up
  std::optional<std::string> down_states(const Channel& channel) const;

  /// Why nothing comes from other robots on this channel now. None: a link that carries it is up,
  /// or no link does.
  std::optional<Refusal> links_down(std::uint16_t number) const;

  /// Channels in use, by number.
  std::vector<ChannelView> views() const;

 private:
  using Channels = std::unordered_map<std::uint16_t, Channel>;

  bool default_timestamping(std::uint16_t number) const;
  std::optional<Refusal> check_carried(const ChannelRequest& request, std::uint16_t number,
                                       bool is_timestamped) const;
  std::optional<Refusal> open_anew(Channel& channel, bool is_timestamped);
  std::optional<Refusal> open(Channel& channel);
  void close(Channel& channel);
  bool evict_idle();
  void erase(Channels::iterator channel);
  ChannelLimits limits_of(std::uint16_t channel, bool is_timestamped) const;

  ChannelTable& names_;
  const StationList& stations_;
  Channels channels_;
  NumberTable<Channel*> channels_by_number_;
  std::uint64_t use_count_ = 0;
};

}  // namespace swarmtalk::daemon
