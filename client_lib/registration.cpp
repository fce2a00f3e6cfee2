#include "client_lib/registration.hpp"

namespace swarmtalk::client {

/// What no daemon could take is refused here: one frame that is not the protocol would cost the
/// client its connection, again and again.
bool Registration::takes(HandleState& handle) {
  if (handle.key->problem) return true;
  handle.status = handle.key->problem;
  deliveries_.report_untold(handle.status);
  return false;
}

/// Else it has been registered with a new connection, or will be.
bool Registration::is_now() {
  if (hooks_.has_started()) return hooks_.is_greeted();
  if (const Status status = hooks_.connect(); !status) {
    deliveries_.report_untold(status);
  }
  return false;
}

void Registration::wait_for(HandleState& handle) {
  if (hooks_.wait([&] { return handle.is_answered; })) return;
  handle.status = Status(StatusCode::kTimeout);
  deliveries_.report(handle.status);
}

}  // namespace swarmtalk::client
