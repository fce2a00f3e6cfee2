// Listening: the Observer's subscriptions to channels: those that viewers have open, for as long as
// one of them looks; those that --channel names; and those that programs of this robot use, while
// there is room. A daemon lets one program use so many channels and no more, so a window that is
// opened takes the place of a channel that nobody looks at. What is left out is named. On the
// client's thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <swarmtalk/client.hpp>

#include "view/source.hpp"

namespace swarmtalk::view {

/// Of a subscriber: the daemon has said no.
bool is_refused(const Status& status);

class Listening {
 public:
  using Clock = std::chrono::steady_clock;
  using Receive = std::function<void(const Message&)>;

  static constexpr std::size_t kMostLookedAt = 24;  // of all viewers together
  static constexpr std::size_t kMostLeftOut = 64;   // that are named at a time
  static constexpr std::size_t kMostTold = 256;     // on stderr
  static constexpr std::size_t kMostShown = 80;     // bytes of a name there

  /// @param client  outlives this object
  Listening(Client& client, Receive receive) : client_(client), receive_(std::move(receive)) {}

  /// A viewer opens a channel. @param name  a name, or digits. @return why not
  Status open(const std::string& name);
  /// As many times as open() has said yes.
  void close(const std::string& name);
  /// Listens to it until the end. @return why not
  Status keep(const std::string& name);

  /// What the daemon says of its channels: listens to those that other programs use, and to none
  /// that nobody uses or looks at any more. Tries again what was refused.
  /// @param own_publishers  channels on which this program has a publisher
  /// @param reserved  channels that are listened to elsewhere
  void note_status(const DaemonStatus& status, const std::set<std::uint16_t>& own_publishers,
                   const std::set<std::uint16_t>& reserved, Clock::time_point now);

  /// Names a channel that is not heard, once on stderr.
  void leave_out(const std::string& name, const Status& why);

  std::optional<std::uint16_t> number_of(const std::string& name) const;
  std::size_t count() const { return held_.size(); }
  const LeftOut& left_out() const { return left_out_; }

 private:
  struct Held {
    Subscriber subscriber;
    std::size_t viewers = 0;  // that look at it
    bool is_kept = false;     // until the end
    bool is_in_use = false;   // by programs of this robot
  };
  using Entry = std::map<std::string, Held>::iterator;

  Entry find(const std::string& name);
  Entry find(std::uint16_t number);
  Subscriber subscriber_of(const std::string& name);
  Status subscribe(const std::string& name, Entry& entry);
  bool drop_one_in_use();
  void drop(Entry entry);
  std::string name_of(std::uint16_t number) const;

  Client& client_;
  Receive receive_;
  std::map<std::string, Held> held_;            // by the name that was asked for first
  std::map<std::string, std::string> aliases_;  // other names of the same channels
  std::map<std::uint16_t, std::string> names_;  // that the daemon tells
  LeftOut left_out_;
  std::set<std::string> told_;  // on stderr
  Clock::time_point retry_at_{};
};

}  // namespace swarmtalk::view
