// One request to the running daemon, one answer.
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>

#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/operator.hpp"

namespace swarmtalk::cli {
namespace {

constexpr auto kAnswerTimeout = std::chrono::seconds(5);

}  // namespace

Status OperatorConnection::open(const std::string& configured_path) {
  const std::string path = client::socket_path(configured_path);
  if (const Status status = connection_.open(path); !status) return status;
  ipc::Envelope hello;
  hello.mutable_hello()->set_major(ipc::kProtocolMajor);
  hello.mutable_hello()->set_minor(ipc::kProtocolMinor);
  hello.mutable_hello()->set_name("swarmtalk-cli");
  ipc::Envelope answer;
  return request(hello, answer);
}

Status OperatorConnection::request(ipc::Envelope& question, ipc::Envelope& answer) {
  question.set_request_id(++last_id_);
  if (!connection_.append(question)) {
    return Status(StatusCode::kBadArgument, "the request is too long");
  }
  if (const Status status = connection_.flush(); !status) return lost();
  do {
    if (const Status status = next(answer, kAnswerTimeout); !status) return status;
  } while (answer.request_id() != last_id_ && !answer.has_failure());
  if (!answer.has_failure()) return Status();
  const ipc::Failure& failure = answer.failure();
  if (failure.code() == ipc::ERROR_VERSION) {
    return Status(StatusCode::kVersionMismatch, failure.text());
  }
  if (failure.code() == ipc::ERROR_UNSUPPORTED) {
    return Status(StatusCode::kVersionMismatch,
                  "this swarmtalkd is older than swarmtalk-cli and does not know the request; "
                  "install both of one release");
  }
  return Status(StatusCode::kBadArgument, failure.text());
}

Status OperatorConnection::next(ipc::Envelope& envelope, std::chrono::milliseconds timeout) {
  const Clock::time_point deadline = Clock::now() + timeout;
  for (;;) {
    switch (connection_.next(envelope)) {
      case ipc::ReadResult::kEnvelope:
        return Status();
      case ipc::ReadResult::kMalformed:
        return Status(StatusCode::kVersionMismatch, "the daemon does not speak the local protocol");
      case ipc::ReadResult::kNeedMore:
        break;
    }
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd waiting{connection_.fd(), POLLIN, 0};
    const int ready = ::poll(&waiting, 1, static_cast<int>(std::max<std::int64_t>(left, 0)));
    if (ready == 0 || left < 0) {
      return Status(StatusCode::kTimeout, "swarmtalkd does not answer; is it stopped?");
    }
    if (ready < 0 && errno == EINTR && caught_signal() != 0) return Status();
    if (ready > 0 && !connection_.receive()) return lost();
  }
}

Status OperatorConnection::lost() {
  return Status(StatusCode::kDisconnected, "swarmtalkd closed the connection");
}

}  // namespace swarmtalk::cli
