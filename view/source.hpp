// Source: where what is shown comes from, a daemon (Observer) or a recording (Playback): the swarm,
// its traffic, and the time that it is there. Takes messages of either into both. On the
// io_context's thread.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "view/reports.hpp"
#include "view/scene/swarm.hpp"
#include "view/traffic.hpp"

namespace swarmtalk::view {

class Playback;

/// Channels that are not heard, by their names or numbers in digits, and why.
using LeftOut = std::map<std::string, std::string>;

class Source {
 public:
  Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;
  virtual ~Source() = default;

  const Swarm& swarm() const { return swarm_; }
  const Traffic& traffic() const { return traffic_; }

  /// The time that ages are counted to: the present, or the recording's.
  virtual Time now() const = 0;
  /// The wall clock at now(), in nanoseconds since 1970.
  virtual std::uint64_t wall_ns() const = 0;
  /// Null: this is no recording.
  virtual Playback* playback() { return nullptr; }

  virtual void set_watched(bool is_watched) = 0;
  /// The robot whose card is open, so that its details are asked for.
  virtual void want_details(std::uint32_t robot) = 0;
  /// Whether robots farther away can be asked; else why not.
  virtual Status questions() const = 0;

  /// A viewer opens a channel, and listens until it has closed it. @param name  a name, or digits
  /// @return why it cannot be listened to
  virtual Status open_channel(const std::string& name) = 0;
  /// As many times as open_channel() has said yes.
  virtual void close_channel(const std::string& name) = 0;
  /// Of a channel that is open; none: it is not known yet.
  virtual std::optional<std::uint16_t> number_of(const std::string& name) const = 0;
  /// Channels that cannot be listened to.
  virtual const LeftOut& left_out() const = 0;

  /// What was heard of a channel up to now(), the oldest first; only a recording knows.
  virtual const std::deque<HeardMessage>& recent_messages(std::uint16_t channel) const;

  /// Sends one message. @param channel  a name, or digits
  virtual Status publish(const std::string& channel, const std::string& payload) = 0;

  /// None: the daemon is there; else since when it is not.
  virtual std::optional<Time> lost_daemon_at() const { return std::nullopt; }
  virtual std::string daemon_name() const { return {}; }
  /// What the daemon said of itself last.
  virtual const DaemonStatus& status() const = 0;

  std::function<void(const HeardMessage&)> on_message = [](const HeardMessage&) {};
  std::function<void(const LogLine&)> on_line = [](const LogLine&) {};
  /// The time has jumped: swarm and traffic are others than a moment ago.
  std::function<void()> on_jump = [] {};

 protected:
  /// @param size_bytes  of a payload that is not there
  void take_message(const Message& message, Time at, std::size_t size_bytes = 0);
  /// Each message before it is told.
  virtual void keep(const HeardMessage& /*message*/) {}
  void take_line(std::uint32_t robot, const std::string& text, Time at);
  /// A message of the channel harvest: a report, or values that somebody asked for.
  void take_harvest(const Message& message, Time at);

  Swarm swarm_;
  Traffic traffic_;
  Reports reports_;
};

/// Whether a channel is called by its number.
bool is_channel_number(const std::string& name);

}  // namespace swarmtalk::view
