// Inbox: what the daemon sends goes to the part that it concerns. On the owner's thread.
#pragma once

#include "client_lib/deliveries.hpp"
#include "client_lib/handles.hpp"
#include "client_lib/requests.hpp"
#include "client_lib/silence.hpp"

namespace swarmtalk::client {

class Inbox {
 public:
  /// All must outlive it.
  Inbox(Handles& handles, Requests& requests, Deliveries& deliveries, Silence& silence)
      : handles_(handles), requests_(requests), deliveries_(deliveries), silence_(silence) {}

  /// @param may_call  callbacks may run at once
  void take(const ipc::DeliverFrame& message, bool may_call) {
    handles_.deliver(message, may_call);
    run_between(may_call);
  }
  void take(const ipc::Envelope& envelope, bool may_call);

 private:
  /// Before the next of what was read at once.
  void run_between(bool may_call) {
    if (may_call && !deliveries_.has_read_ahead()) deliveries_.run();
  }
  void fail(const ipc::Failure& failure, bool may_call);

  Handles& handles_;
  Requests& requests_;
  Deliveries& deliveries_;
  Silence& silence_;
};

}  // namespace swarmtalk::client
