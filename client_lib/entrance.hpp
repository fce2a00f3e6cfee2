// Entrance: who may come into a Client, and what a call that may not is told: nothing runs for a
// second thread, and process() not inside a callback. Any thread.
#pragma once

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

  /// Whether the calling thread is inside.
  bool is_mine() const { return turn_.is_mine(); }

  /// A call that runs callbacks. Not inside another.
  template <typename Call>
  Status run(const Call& call) {
    const Turn::Stay stay(turn_);
    return stay.is_first() ? call() : refuse(stay);
  }

  /// A call that waits for the daemon: inside a callback as well, but in one thread at a time.
  template <typename Call>
  Status wait(const Call& call) {
    const Turn::Stay stay(turn_);
    return stay.is_refused() ? refuse(stay) : call();
  }

  /// A call that nobody misses: not made while another thread is inside, and that is not told.
  template <typename Call>
  void try_wait(const Call& call) {
    const Turn::Stay stay(turn_);
    if (!stay.is_refused()) call();
  }

  /// Callbacks are about to run: tells once of two threads that call in turn. @pre inside
  void note_caller() {
    if (turn_.is_called_in_turn()) report_two_callers();
  }

 private:
  Status refuse(const Turn::Stay& stay);
  void report_two_callers();

  Turn turn_;
  Reports& reports_;
  std::function<void()> on_report_;
};

}  // namespace swarmtalk::client
