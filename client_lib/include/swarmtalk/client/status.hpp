// Status: what became of a call, as a code for the program and a sentence for a person. Error is
// the same as an exception, thrown only by Client::connected(). Values; any thread.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace swarmtalk {

namespace client {
class Engine;
struct Unread;
}  // namespace client

/// What became of a call. docs/client.md says what to do about each.
enum class StatusCode {
  kOk,
  kBusy,             // as many messages of this publisher wait as may
  kTooLong,          // message longer than the channel carries; the text names the limit
  kDisconnected,     // no connection to the daemon now; the library reconnects by itself
  kNoDaemon,         // no socket of a daemon is there
  kDaemonDead,       // the socket exists, nobody listens on it
  kNoPermission,     // not in group swarmtalk
  kVersionMismatch,  // daemon and library speak different majors; the text names both
  kTimeout,          // the daemon did not answer in time
  kBadChannel,       // name or number impossible on this daemon
  kChannelConflict,  // registered before with another `timestamped`
  kLimit,            // a limit of the daemon's configuration is reached
  kBadTtl,           // larger than the link carries
  kBadPose,          // not finite, or outside +-32.767 m
  kUnsupported,      // an older daemon that does not know the request
  kLinkDown,         // no link could take the message
  kProtocol,         // the daemon sent something that is not the protocol
  kDropped,          // a newer message of this publisher took its place in the queue
  kRate,             // this program publishes faster than the daemon's configuration allows
  kBadArgument,      // the call makes no sense; the text says why
  kSystem,           // an error of the operating system, in the text
};

/// What became of a call: a code for the program, a sentence for people.
class Status {
 public:
  Status() = default;
  /// An empty text stands for the general sentence of the code.
  explicit Status(StatusCode code, std::string text = {}) : code_(code), text_(std::move(text)) {}

  /// Whether it was done.
  bool ok() const { return code() == StatusCode::kOk; }
  /// The same.
  explicit operator bool() const { return ok(); }
  /// Why it was not done; kOk: it was.
  StatusCode code() const {
    if (unread_) mark_read();
    return code_;
  }

  /// One sentence with the remedy, without a full stop. Valid as long as this Status.
  std::string_view text() const;

 private:
  friend class client::Engine;
  friend struct client::Unread;
  void mark_read() const;

  StatusCode code_ = StatusCode::kOk;
  std::string text_;                        // empty: the code's general sentence
  std::shared_ptr<client::Unread> unread_;  // of a refused message: tells when nobody looks
};

/// Thrown by Client::connected() only.
class Error : public std::runtime_error {
 public:
  /// With the text of the Status.
  explicit Error(Status status)
      : std::runtime_error(std::string(status.text())), status_(std::move(status)) {}
  /// What went wrong.
  const Status& status() const { return status_; }

 private:
  Status status_;
};

}  // namespace swarmtalk
