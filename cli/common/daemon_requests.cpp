#include "cli/common/daemon_requests.hpp"

#include <poll.h>

namespace swarmtalk::cli {
namespace {

constexpr auto kGreetingTimeout = std::chrono::milliseconds(2000);

}  // namespace

Status DaemonRequests::connect(const std::string& socket_path) {
  Status status = connection_.open(client::socket_path(socket_path));
  if (!status) return status;
  ipc::Envelope hello;
  hello.mutable_hello()->set_major(ipc::kProtocolMajor);
  hello.mutable_hello()->set_minor(ipc::kProtocolMinor);
  hello.mutable_hello()->set_name("swarmtalk-cli");
  connection_.append(hello);
  connection_.flush();  // what went wrong is told by what can be read
  const auto answer = wait(kGreetingTimeout, status);
  if (!status) return status;
  if (!answer) return Status(StatusCode::kTimeout, "swarmtalkd does not answer");
  if (answer->has_failure()) {
    const bool is_version = answer->failure().code() == ipc::ERROR_VERSION;
    return Status(is_version ? StatusCode::kVersionMismatch : StatusCode::kDisconnected,
                  answer->failure().text());
  }
  return Status();
}

Status DaemonRequests::send(ipc::Envelope& request) {
  request.set_request_id(++last_id_);
  if (!connection_.append(request)) {
    return Status(StatusCode::kTooLong, "the request is longer than the local protocol carries");
  }
  return connection_.flush();
}

std::optional<ipc::Envelope> DaemonRequests::wait(std::chrono::milliseconds timeout,
                                                  Status& status) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  ipc::Envelope envelope;
  for (;;) {
    const ipc::ReadResult result = connection_.next(envelope);
    if (result == ipc::ReadResult::kEnvelope) return envelope;
    if (result == ipc::ReadResult::kMalformed) {
      status = Status(StatusCode::kDisconnected,
                      "swarmtalkd sent something that is not a frame of its protocol");
      return std::nullopt;
    }
    if (!status) return std::nullopt;  // gone, and all it said has been read
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return std::nullopt;
    pollfd poller{connection_.fd(), POLLIN, 0};
    if (connection_.has_outgoing()) poller.events |= POLLOUT;
    if (::poll(&poller, 1, static_cast<int>(left.count()) + 1) < 0) return std::nullopt;
    if ((poller.revents & POLLOUT) != 0) status = connection_.flush();
    if ((poller.revents & ~POLLOUT) != 0) status = connection_.receive();
  }
}

}  // namespace swarmtalk::cli
