#include "client_lib/requests.hpp"

#include "client_lib/convert.hpp"

namespace swarmtalk::client {

std::uint32_t Requests::send(Completion done) {
  if (++last_id_ == 0) ++last_id_;
  outgoing_.set_request_id(last_id_);
  if (!append_(outgoing_)) {
    done(nullptr,
         Status(StatusCode::kBadArgument, "the request is longer than the protocol allows"));
    return last_id_;
  }
  pending_[last_id_] = std::move(done);
  return last_id_;
}

void Requests::send_only() {
  send([this](const ipc::Envelope*, const Status& status) {
    if (!status) note_refusal(status);
  });
}

void Requests::answer(const ipc::Envelope& envelope) {
  const auto found = pending_.find(envelope.request_id());
  if (found == pending_.end()) return;  // its caller gave up waiting
  const Completion done = std::move(found->second);
  pending_.erase(found);
  if (envelope.has_failure()) {
    done(nullptr, convert(envelope.failure()));
  } else {
    done(&envelope, Status());
  }
}

void Requests::fail_all(const Status& why) {
  for (auto pending = std::exchange(pending_, {}); auto& [id, done] : pending) done(nullptr, why);
}

}  // namespace swarmtalk::client
