// Hints: what a programmer is told on stderr, each once: a name that looks like a number or like a
// wildcard, a subscription that never ran, nobody around. On the owner's thread.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "client_lib/state.hpp"

namespace swarmtalk::client {

/// On stderr, as everything that the library says there.
void print_hint(const std::string& text);

class Hints {
 public:
  using Print = std::function<void(const std::string&)>;

  /// @param are_wanted  not by a program that prints its own errors
  explicit Hints(std::function<bool()> are_wanted, Print print = print_hint)
      : are_wanted_(std::move(are_wanted)), print_(std::move(print)) {}

  void tell(const std::string& text) const {
    if (are_wanted_()) print_(text);
  }

  /// The program advertises or subscribes by this key.
  void note_name(const ChannelKey& key);
  /// The program asked for the robots around, and there is none.
  void note_nobody_around();
  /// Callbacks may run.
  void note_running() { has_run_ = true; }
  /// A subscription that the daemon knows of ends. @param label  of its channel
  void note_end(const std::string& label) const;

 private:
  void note_digits(const std::string& name);
  void note_wildcard(const std::string& name);

  std::function<bool()> are_wanted_;
  Print print_;
  bool has_run_ = false;
  bool has_told_wildcard_ = false;
  bool has_told_digits_ = false;
  bool has_told_nobody_ = false;
};

}  // namespace swarmtalk::client
