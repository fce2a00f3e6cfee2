// AllChannels: subscriptions to every channel there is: those in use on this robot, and those on
// the air, as soon as a frame with one of their packets has come. That frame's own message is
// missed: the first of a channel that nobody has subscribed to. On the client's thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>

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

  /// Takes in new channels; call when fd() is readable, and at next(). Tells refusals on stderr.
  void look();
  /// -1 while the daemon is away.
  int fd() const { return air_.fd(); }
  Clock::time_point next() const { return next_; }

  std::size_t count() const { return subscribers_.size(); }
  const AirWatch& air() const { return air_; }
  /// Its name, else its number in digits.
  std::string name_of(std::uint16_t number) const;

 private:
  void ask();
  void subscribe(std::uint16_t number, std::optional<bool> is_timestamped);

  Client& client_;
  Policy policy_;
  Receive receive_;
  AirWatch air_;
  std::map<std::uint16_t, Subscriber> subscribers_;
  std::set<std::uint16_t> refused_;
  std::map<std::uint16_t, std::string> names_;
  Clock::time_point next_ = Clock::time_point::min();
  bool is_sealed_told_ = false;
};

}  // namespace swarmtalk::cli
