// Refusals: messages that send() refused and nobody looked at, told of at most once a second. Any
// thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string_view>

#include <swarmtalk/client/status.hpp>

#include "client_lib/wakeup.hpp"

namespace swarmtalk::client {

class Refusals {
 public:
  /// Where on_error is the program's own, what it is to be told, if it is time again. Else stderr
  /// is told at once: a program that only sends may never come to process().
  /// @param is_unread  known: not of a program in C, whose looks cannot be seen
  std::optional<Status> note(std::string_view channel, std::string_view why, bool is_unread,
                             Wakeup::Clock::time_point now);

  /// At the end: how many more there were than have been told.
  void tell_rest();

  bool tells_stderr() const { return tells_stderr_.load(); }
  void tells_stderr(bool value) { tells_stderr_.store(value); }

 private:
  std::mutex mutex_;
  std::uint64_t count_ = 0;  // not told yet
  std::optional<Wakeup::Clock::time_point> told_;
  std::atomic<bool> tells_stderr_{true};  // on_error is the default one
};

}  // namespace swarmtalk::client
