// Registration: a new publisher or subscriber is taken in, told to the daemon, and its answer is
// waited for. On the owner's thread.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "client_lib/deliveries.hpp"
#include "client_lib/handles.hpp"
#include "client_lib/state.hpp"

namespace swarmtalk::client {

class Registration {
 public:
  struct Hooks {
    std::function<bool()> has_started;  // a connection was asked for before
    std::function<Status()> connect;    // registers all that there is
    std::function<bool()> is_greeted;   // the daemon takes what is registered
    std::function<bool(const std::function<bool()>& enough)> wait;  // as long as for an answer
  };

  /// All must outlive it.
  Registration(Handles& handles, Deliveries& deliveries, Hooks hooks)
      : handles_(handles), deliveries_(deliveries), hooks_(std::move(hooks)) {}

  /// What comes of it is the handle's status; a failure is told to the program as well.
  template <typename State>
  void add(const std::shared_ptr<State>& handle) {
    if (!takes(*handle)) return;
    handles_.add(handle);
    if (is_now()) {
      handles_.register_one(handle);
      wait_for(*handle);
    }
  }

 private:
  bool takes(HandleState& handle);
  bool is_now();
  void wait_for(HandleState& handle);

  Handles& handles_;
  Deliveries& deliveries_;
  Hooks hooks_;
};

}  // namespace swarmtalk::client
