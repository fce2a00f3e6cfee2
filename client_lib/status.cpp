#include "swarmtalk/client/status.hpp"

#include "client_lib/unread.hpp"

namespace swarmtalk {

void Status::mark_read() const {
  unread_->is_read.store(true);
}

std::string_view Status::text() const {
  if (unread_) mark_read();
  if (!text_.empty()) return text_;
  switch (code_) {
    case StatusCode::kOk:
      return "ok";
    case StatusCode::kBusy:
      return "as many messages of this publisher wait as may; try again when one has left";
    case StatusCode::kTooLong:
      return "the message is longer than the channel carries";
    case StatusCode::kDisconnected:
      return "not connected to swarmtalkd; reconnecting";
    case StatusCode::kNoDaemon:
      return "swarmtalkd is not running; start it with: systemctl start swarmtalkd";
    case StatusCode::kDaemonDead:
      return "swarmtalkd has died; systemctl restart swarmtalkd";
    case StatusCode::kNoPermission:
      return "no permission for the socket; join group swarmtalk";
    case StatusCode::kVersionMismatch:
      return "daemon and library speak different protocols";
    case StatusCode::kTimeout:
      return "swarmtalkd did not answer in time";
    case StatusCode::kBadChannel:
      return "this channel is impossible on this daemon";
    case StatusCode::kChannelConflict:
      return "the channel is registered with another value of `timestamped`";
    case StatusCode::kLimit:
      return "a limit of the daemon's configuration is reached";
    case StatusCode::kBadTtl:
      return "the TTL is larger than the link carries";
    case StatusCode::kBadPose:
      return "a pose must be finite and within +-32.767 m";
    case StatusCode::kUnsupported:
      return "this swarmtalkd does not know the request; update it";
    case StatusCode::kLinkDown:
      return "no link could take the message";
    case StatusCode::kProtocol:
      return "swarmtalkd sent something that is not the protocol";
    case StatusCode::kDropped:
      return "a newer message of this publisher took its place in the queue";
    case StatusCode::kRate:
      return "this program publishes faster than limits.publish_rate_hz of the daemon";
    case StatusCode::kBadArgument:
      return "bad argument";
    case StatusCode::kSystem:
      return "error of the operating system";
  }
  return "unknown error";
}

}  // namespace swarmtalk
