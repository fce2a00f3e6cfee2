// Observer: the source that is a client of one daemon. It asks for neighbours and status, listens
// to the channels and keeps Swarm and Traffic up to date, also over the daemon's restarts. On the
// io_context's thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "view/listening.hpp"
#include "view/source.hpp"

namespace swarmtalk::view {

struct ObserverOptions {
  std::string socket_path;            // empty: the client library's
  std::vector<std::string> channels;  // listened to, besides those that are found
};

class Observer final : public Source {
 public:
  static constexpr std::size_t kMostPublishers = 16;  // the longest unused gives way

  Observer(boost::asio::io_context& io, ObserverOptions options);
  ~Observer() override;

  /// Connects, and from then on goes on by itself. @return why there is no daemon
  Status start();

  Time now() const override { return Clock::now(); }
  std::uint64_t wall_ns() const override;
  /// Somebody looks: neighbours are asked for ten times a second, else once.
  void set_watched(bool is_watched) override { is_watched_ = is_watched; }
  void want_details(std::uint32_t robot) override { reports_.want(robot); }
  Status questions() const override { return asker_.status(); }
  Status open_channel(const std::string& name) override { return listening_.open(name); }
  void close_channel(const std::string& name) override { listening_.close(name); }
  std::optional<std::uint16_t> number_of(const std::string& name) const override {
    return listening_.number_of(name);
  }
  const LeftOut& left_out() const override { return listening_.left_out(); }
  Status publish(const std::string& channel, const std::string& payload) override;
  std::optional<Time> lost_daemon_at() const override { return lost_daemon_at_; }
  std::string daemon_name() const override { return client_.daemon_name(); }
  const DaemonStatus& status() const override { return status_; }

 private:
  void wait_readable();
  void note_reading(Time begin);
  void rest();
  void wait_tick();
  void tick();
  void ask_status(Time now);
  void look(Time now);
  Status make_publisher(const std::string& channel);

  struct Sender {
    Publisher publisher;
    Time used_at{};
  };

  ObserverOptions options_;
  Client client_;
  boost::asio::posix::stream_descriptor readable_;
  boost::asio::steady_timer timer_;
  boost::asio::steady_timer pause_;
  DaemonStatus status_;
  Listening listening_;
  std::map<std::string, Sender> senders_;  // by channel
  Subscriber debug_, harvest_;
  Publisher asker_;  // on harvest
  Time looked_at_{};
  Time rest_until_{};
  std::optional<Time> lost_daemon_at_;
  Time status_asked_at_{};
  bool is_watched_ = false;
};

}  // namespace swarmtalk::view
