// What an operator asks of the running daemon: one request, one answer.
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

int reload(const Common& common) {
  OperatorConnection daemon;
  if (const Status status = daemon.open(common.socket_path); !status) return fail(status);
  ipc::Envelope question;
  ipc::Envelope answer;
  question.mutable_reload();
  if (const Status status = daemon.request(question, answer); !status) return fail(status);
  std::string text;
  for (const std::string& key : answer.reloaded().applied()) text += "applied: " + key + "\n";
  for (const std::string& key : answer.reloaded().needs_restart()) {
    text += "needs a restart: " + key + "\n";
  }
  return print(text.empty() ? "nothing has changed\n" : text);
}

int log_level(const Common& common, const LogLevelArguments& arguments) {
  OperatorConnection daemon;
  if (const Status status = daemon.open(common.socket_path); !status) return fail(status);
  ipc::Envelope question;
  ipc::Envelope answer;
  ipc::SetLogLevel& request = *question.mutable_set_log_level();
  if (!arguments.level.empty()) request.set_level(arguments.level);
  if (!arguments.subsystem.empty()) request.set_subsystem(arguments.subsystem);
  if (const Status status = daemon.request(question, answer); !status) return fail(status);
  std::string text;
  for (const ipc::LogLevel& level : answer.log_levels().levels()) {
    text += level.subsystem() + " " + level.level() + "\n";
  }
  return print(text);
}

int node_id(const Common& common, const std::string& id) {
  OperatorConnection daemon;
  if (const Status status = daemon.open(common.socket_path); !status) return fail(status);
  ipc::Envelope question;
  ipc::Envelope answer;
  question.mutable_set_node_id();
  if (id != "auto") {
    question.mutable_set_node_id()->set_node_id(static_cast<std::uint32_t>(std::stoul(id)));
  }
  const Status status = daemon.request(question, answer);
  return status ? kExitOk : fail(status);
}

int metrics(const Common& common) {
  OperatorConnection daemon;
  if (const Status status = daemon.open(common.socket_path); !status) return fail(status);
  ipc::Envelope question;
  ipc::Envelope answer;
  question.mutable_get_metrics();
  if (const Status status = daemon.request(question, answer); !status) return fail(status);
  return print(answer.metrics().text());
}

}  // namespace swarmtalk::cli
