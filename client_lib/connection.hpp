// One non-blocking connection to the daemon: the socket, what has been read and what waits to be
// written. Says what happened; decides nothing. Used by Engine, on its thread.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include <swarmtalk/client/status.hpp>

#include "ipc/framing.hpp"
#include "ipc/message_frames.hpp"

namespace swarmtalk::client {

class Connection {
 public:
  Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { close(); }

  /// Connects to the socket at `path`; waits for nothing.
  /// @return kOk; kNoDaemon, kDaemonDead, kNoPermission, kBadArgument, kSystem; kTimeout while the
  ///   daemon's queue of connections is full: try again
  Status open(const std::string& path);
  void close();
  bool is_open() const { return fd_ >= 0; }
  int fd() const { return fd_; }

  /// Queues one envelope. @return false when it is longer than the protocol allows
  bool append(const ipc::Envelope& envelope) { return ipc::append_frame(envelope, outgoing_); }
  bool append(const ipc::PublishFrame& frame) { return ipc::append_frame(frame, outgoing_); }

  /// Writes what the socket takes now; without one, nothing. @return kOk, or kDisconnected
  Status flush();
  /// Writes all, waiting for the socket. @return whether nothing is left
  bool flush_until(std::chrono::steady_clock::time_point deadline);
  /// Whether writing has failed: nothing can be written until the next open().
  bool is_lost() const { return !loss_.ok(); }
  bool has_outgoing() const { return !outgoing_.empty(); }
  /// Whether flush() has nothing to do and nothing to tell.
  bool is_idle() const { return outgoing_.empty() && !is_lost(); }
  std::size_t outgoing_bytes() const { return outgoing_.size(); }

  /// Reads what is there, at most one buffer. @return kOk, or kDisconnected: what was read before
  ///   is still handed out by next()
  Status receive();
  /// Whether the last receive() may have left something in the socket.
  bool may_have_more() const { return may_have_more_; }
  ipc::ReadResult next(ipc::Envelope& envelope) { return reader_.next(envelope); }
  /// Its bytes; valid until the next receive() or close().
  ipc::ReadResult next(std::string_view& envelope) { return reader_.next(envelope); }

 private:
  int fd_ = -1;
  ipc::FrameReader reader_;
  bool may_have_more_ = false;
  std::string outgoing_;  // starts at the first unwritten byte
  Status loss_;           // that writing has met, until close()
};

/// What an errno of connect() to `path` means and what to do about it. ENOTSOCK: a file of another
/// kind is there.
Status connect_error(int error, const std::string& path);

/// The socket's path: `configured`, else $SWARMTALK_SOCKET, else the standard one.
std::string socket_path(const std::string& configured);

}  // namespace swarmtalk::client
