#include "daemon/session/client_answers.hpp"

#include "text/plain.hpp"

namespace swarmtalk::daemon {
namespace {

void fill(ipc::Failure& failure, const Refusal& refusal) {
  failure.set_code(refusal.code);
  failure.set_text(text::plain(refusal.text));  // may name a file or a device of any bytes
  if (refusal.limit) failure.set_limit(*refusal.limit);
}

}  // namespace

ipc::Envelope& ClientAnswers::make() {
  forms_.answer.Clear();
  if (request_id_ != 0) forms_.answer.set_request_id(request_id_);
  return forms_.answer;
}

void ClientAnswers::send_done() {
  make().mutable_done();
  send();
}

void ClientAnswers::refuse(const Refusal& refusal) {
  ++counters_.requests_refused;
  fill(*make().mutable_failure(), refusal);
  send();
}

ipc::Envelope& ClientAnswers::make_notice() {
  forms_.notice.Clear();
  return forms_.notice;
}

void ClientAnswers::refuse_message(std::uint32_t publisher_id, std::uint64_t publish_number,
                                   const Refusal& refusal) {
  ++counters_.requests_refused;
  ipc::Failure& failure = *make_notice().mutable_failure();
  fill(failure, refusal);
  failure.set_publisher_id(publisher_id);
  failure.set_publish_number(publish_number);
  send_notice();
}

}  // namespace swarmtalk::daemon
