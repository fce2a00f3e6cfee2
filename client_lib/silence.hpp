// Silence: a program that listens and does not hear a channel is told on stderr, once, what may be
// wrong: nobody publishes the channel and another is called nearly so, or no other robot is around.
// On the owner's thread.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_lib/requests.hpp"
#include "client_lib/state.hpp"
#include "client_lib/wakeup.hpp"

namespace swarmtalk::client {

class Silence {
 public:
  static constexpr std::size_t kMostExpected = 64;  // subscriptions; more are not watched

  /// Both must outlive it. @param tell  is given the sentence
  /// @param patience  of a program that runs, connected, before the daemon is asked
  Silence(Requests& requests, Wakeup& wakeup, std::function<void(const std::string&)> tell,
          std::chrono::milliseconds patience = std::chrono::seconds(3))
      : requests_(requests), wakeup_(wakeup), tell_(std::move(tell)), patience_(patience) {}

  /// The program subscribes, and waits for messages.
  void expect(std::shared_ptr<const SubscriberState> subscriber);
  /// Something else has said why no message comes.
  void end() { is_over_ = has_ended_ = true; }
  /// The program runs, connected. A request may wait to be written afterwards.
  void watch();
  /// The connection is lost: it begins anew with the next.
  void forget() { deadline_.reset(); }

 private:
  using Subscribers = std::vector<std::shared_ptr<const SubscriberState>>;

  void ask();
  void ask_who_is_around();
  /// Those that are there and have heard nothing. @param silent  else all
  Subscribers expected(bool silent) const;
  bool tell_misspelt(const ipc::Status& daemon) const;
  void tell_alone(const ipc::Neighbours& around) const;

  Requests& requests_;
  Wakeup& wakeup_;
  std::function<void(const std::string&)> tell_;
  std::chrono::milliseconds patience_;
  std::vector<std::weak_ptr<const SubscriberState>> expected_;
  std::optional<Wakeup::Clock::time_point> deadline_;
  bool is_over_ = false;    // nothing is to be asked any more
  bool has_ended_ = false;  // nor told
};

}  // namespace swarmtalk::client
