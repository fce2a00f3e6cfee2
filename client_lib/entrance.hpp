// Entrance: who may come into a Client, and what a call that may not is told: nothing runs for a
// second thread or in a child process, and process() not inside a callback. Any thread.
#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <functional>
#include <utility>

#include <swarmtalk/client/status.hpp>

#include "client_lib/reports.hpp"
#include "client_lib/turn.hpp"

namespace swarmtalk::client {

class Entrance {
 public:
  /// @param reports  must outlive it: the answer of run_for(), say, is one that nobody reads
  /// @param on_report  one waits there
  Entrance(Reports& reports, std::function<void()> on_report)
      : reports_(reports), on_report_(std::move(on_report)) {}

  /// Whether this is the process that made the Client, and no child of it.
  bool is_own_process() const { return ::getpid() == process_; }

  /// Whether the calling thread is inside.
  bool is_mine() const { return turn_.is_mine(); }

  /// A call that runs callbacks. Not inside another.
  template <typename Call>
  Status run(const Call& call) {
    if (!is_own_process()) return refuse_child();
    const Turn::Stay stay(turn_);
    return stay.is_first() ? call() : refuse(stay);
  }

  /// A call that waits for the daemon: inside a callback as well, but in one thread at a time.
  template <typename Call>
  Status wait(const Call& call) {
    if (!is_own_process()) return refuse_child();
    const Turn::Stay stay(turn_);
    return stay.is_refused() ? refuse(stay) : call();
  }

  /// A call that nobody misses: not made while another thread is inside, and that is not told.
  template <typename Call>
  void try_wait(const Call& call) {
    const Turn::Stay stay(turn_);
    if (!stay.is_refused()) call();
  }

  /// A call that is made when no thread is inside, nor this one in a callback. @return whether it
  /// was
  template <typename Call>
  bool try_alone(const Call& call) {
    const Turn::Stay stay(turn_);
    if (stay.is_first()) call();
    return stay.is_first();
  }

  /// The same for a call of any thread, made only in the owner's.
  template <typename Call>
  void try_alone_as_owner(const Call& call) {
    if (turn_.is_owner()) try_alone(call);
  }

  /// The answer in a child process; printed once, as nobody else is left to report it.
  Status refuse_child();

  /// Callbacks are about to run: tells once of two threads that call in turn. @pre inside
  void note_caller() {
    if (turn_.is_called_in_turn()) report_two_callers();
  }

 private:
  Status refuse(const Turn::Stay& stay);
  void report_two_callers();

  const pid_t process_ = ::getpid();
  std::atomic<bool> has_told_child_{false};
  Turn turn_;
  Reports& reports_;
  std::function<void()> on_report_;
};

}  // namespace swarmtalk::client
