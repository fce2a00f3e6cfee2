#include "client_lib/inbox.hpp"

#include "client_lib/convert.hpp"

namespace swarmtalk::client {

void Inbox::take(const ipc::Envelope& envelope, bool may_call) {
  if (envelope.has_deliver()) {
    handles_.deliver(ipc::frame_of(envelope.deliver()), may_call);
  } else if (envelope.has_sent()) {
    handles_.end_publication(envelope.sent().publisher_id(), envelope.sent().publish_number(),
                             Status(), may_call);
  } else if (envelope.request_id() != 0) {
    requests_.answer(envelope);
  } else if (envelope.has_failure()) {
    fail(envelope.failure(), may_call);
  }
  // Anything else is from a newer minor: not for us.
  run_between(may_call);
}

void Inbox::fail(const ipc::Failure& failure, bool may_call) {
  if (failure.has_publisher_id()) {
    handles_.end_publication(failure.publisher_id(), failure.publish_number(), convert(failure),
                             may_call);
  } else {
    silence_.end();  // no link is up, say
    deliveries_.report(convert(failure));
  }
}

}  // namespace swarmtalk::client
