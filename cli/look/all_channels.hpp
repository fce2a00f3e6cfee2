// AllChannels: subscriptions to every channel there is: those in use on this robot, and those on
// the air, as soon as a frame with one of their packets has come. That frame's own message is
// missed: the first of a channel that nobody has subscribed to. A daemon lets one program use so
// many channels: for more, this connects as a second one, as far as the daemon's limits for a user
// go. Channels beyond are named on stderr, once each, and tried again. On the client's thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <swarmtalk/client.hpp>

#include "cli/common/deadline.hpp"
#include "cli/look/air_watch.hpp"

namespace swarmtalk::cli {

class AllChannels {
 public:
  using Receive = std::function<void(const std::string& channel, const Message& message)>;

  /// @param client  connected; outlives this object. `receive` gets a channel's name if the daemon
  ///   knows one, else its number
  AllChannels(Client& client, std::string socket_path, Policy policy, Receive receive);

  /// Subscribes to what is there now. @return why the air cannot be watched
  Status start();

  /// Takes in new channels, and messages; call when one of fds() is readable, and at next().
  void look();
  /// -1 of what is away.
  std::vector<int> fds() const;
  Clock::time_point next() const { return next_; }

  std::size_t count() const { return subscribers_.size(); }
  /// "3 channels left out"; empty: none was, ever.
  std::string left_out_text() const;
  const AirWatch& air() const { return air_; }
  /// Its name, else its number in digits.
  std::string name_of(std::uint16_t number) const;

 private:
  void ask();
  void subscribe(std::uint16_t number, std::optional<bool> is_timestamped);
  Status subscribe_with(Client& client, std::uint16_t number, const ChannelOptions& options);
  Client* add_client();

  static constexpr std::size_t kMostMore = 7;

  Client& client_;
  std::vector<std::unique_ptr<Client>> more_;
  std::string socket_path_;
  Policy policy_;
  Receive receive_;
  AirWatch air_;
  std::map<std::uint16_t, Subscriber> subscribers_;
  std::map<std::uint16_t, Clock::time_point> refused_;  // when to try again
  std::set<std::uint16_t> left_out_;                    // at any time
  std::map<std::uint16_t, std::string> names_;
  Clock::time_point next_ = Clock::time_point::min();
  bool is_sealed_told_ = false;
};

}  // namespace swarmtalk::cli
