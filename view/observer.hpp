// Observer: the client of one daemon. It asks for neighbours and status, listens to the channels
// and keeps Swarm and Traffic up to date, also over the daemon's restarts. On the io_context's
// thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "view/reports.hpp"
#include "view/swarm.hpp"
#include "view/traffic.hpp"

namespace swarmtalk::view {

struct ObserverOptions {
  std::string socket_path;            // empty: the client library's
  std::vector<std::string> channels;  // listened to, besides those that are found
};

class Observer {
 public:
  static constexpr std::size_t kMostPublishers = 16;

  Observer(boost::asio::io_context& io, ObserverOptions options);
  ~Observer();
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  /// Connects, and from then on goes on by itself. @return why there is no daemon
  Status start();

  /// Somebody looks: neighbours are asked for ten times a second, else once.
  void set_watched(bool is_watched) { is_watched_ = is_watched; }

  /// The robot whose card is open, so that its details are asked for; 0: none.
  void want_details(std::uint32_t robot) { reports_.want(robot); }

  /// Whether robots farther away can be asked; else why not.
  Status questions() const { return asker_.status(); }

  /// Begins to listen to a channel. @param name  a name, or digits
  /// @return its number; none: the daemon does not take it, or kMostChannels are listened to
  std::optional<std::uint16_t> listen(const std::string& name);

  /// Sends one message. @param channel  a name, or digits
  Status publish(const std::string& channel, const std::string& payload);

  const Swarm& swarm() const { return swarm_; }
  const Traffic& traffic() const { return traffic_; }
  /// None: connected; else what is wrong, and since when.
  const std::optional<Time>& lost_daemon_at() const { return lost_daemon_at_; }
  std::string daemon_name() const { return client_.daemon_name(); }
  /// What our own daemon said of itself last.
  const DaemonStatus& status() const { return status_; }

  std::function<void(const HeardMessage&)> on_message = [](const HeardMessage&) {};
  std::function<void(const LogLine&)> on_line = [](const LogLine&) {};

 private:
  void wait_readable();
  void wait_tick();
  void tick();
  void ask_status(Time now);
  void look(Time now);
  Channel channel_called(const std::string& name);
  void listen_to_number(std::uint16_t number);
  void hear(const Message& message);
  void hear_line(const Message& message);
  void hear_harvest(const Message& message);

  ObserverOptions options_;
  Client client_;
  boost::asio::posix::stream_descriptor readable_;
  boost::asio::steady_timer timer_;
  Swarm swarm_;
  Traffic traffic_;
  DaemonStatus status_;
  std::map<std::string, Subscriber> named_;        // by the name that was asked for
  std::map<std::uint16_t, Subscriber> by_number_;  // found in the daemon's status
  std::map<std::string, Publisher> publishers_;
  Subscriber debug_, harvest_;
  Publisher asker_;  // on harvest
  Reports reports_;
  Time looked_at_{};
  std::optional<Time> lost_daemon_at_;
  Time status_asked_at_{};
  bool is_watched_ = false;
};

}  // namespace swarmtalk::view
