// ClientAnswers: builds what one client is told, but for deliveries: answers to its requests, and
// notices that nobody asked for. On the daemon's thread; nothing here calls back into the hub.
#pragma once

#include <cstdint>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/message/refusal.hpp"
#include "daemon/session/client_output.hpp"
#include "ipc/ipc.pb.h"

namespace swarmtalk::daemon {

/// Reused by every session, one at a time: building allocates nothing. Two, because a notice may
/// come while an answer is being made.
struct AnswerForms {
  ipc::Envelope answer;
  ipc::Envelope notice;
};

class ClientAnswers {
 public:
  /// All must outlive it.
  ClientAnswers(AnswerForms& forms, ClientOutput& output, DaemonCounters& counters)
      : forms_(forms), output_(output), counters_(counters) {}

  /// Which request is in hand. 0: it has no number, or none is
  void begin(std::uint32_t request_id) { request_id_ = request_id; }

  /// An empty answer to the request in hand, to be filled; send() sends it.
  ipc::Envelope& make();
  void send() { output_.add_answer(forms_.answer); }
  /// "Done", and nothing else to say.
  void send_done();
  /// Refuses the request in hand.
  void refuse(const Refusal& refusal);

  /// An empty notice, to be filled; send_notice() sends it.
  ipc::Envelope& make_notice();
  void send_notice() { output_.add_answer(forms_.notice); }
  /// A message has been sent.
  void tell_sent(const ipc::SentFrame& sent) { output_.add_answer(sent); }
  /// A message will not be sent.
  void refuse_message(std::uint32_t publisher_id, std::uint64_t publish_number,
                      const Refusal& refusal);

 private:
  AnswerForms& forms_;
  ClientOutput& output_;
  DaemonCounters& counters_;
  std::uint32_t request_id_ = 0;
};

}  // namespace swarmtalk::daemon
