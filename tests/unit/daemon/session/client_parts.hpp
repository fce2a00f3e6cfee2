// What the tests of a session's parts stand on: its output, read back as envelopes.
#pragma once

#include <algorithm>
#include <vector>

#include "daemon/session/client_answers.hpp"

namespace swarmtalk::daemon {

class ClientParts {
 public:
  /// All answers and notices since the last call.
  std::vector<ipc::Envelope> told() {
    std::vector<ipc::Envelope> envelopes;
    ipc::FrameReader reader;
    ipc::Envelope envelope;
    while (output.refill()) {
      const std::string_view bytes = output.unwritten();
      const auto room = reader.prepare(bytes.size());
      std::copy(bytes.begin(), bytes.end(), room.begin());
      reader.commit(bytes.size());
      output.advance(bytes.size());
    }
    while (reader.next(envelope) == ipc::ReadResult::kEnvelope) envelopes.push_back(envelope);
    return envelopes;
  }

  LimitsConfig limits;
  DaemonCounters counters;
  AnswerForms forms;
  ClientOutput output{limits, counters, [] {}};
  ClientAnswers answers{forms, output, counters};
};

}  // namespace swarmtalk::daemon
