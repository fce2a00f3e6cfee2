// ListeningSocket: the daemon's place in the file system. Opened once at start, before privileges
// are dropped; closed at the end, when it removes what it made and nothing else.
//
// Two daemons that start at once cannot both win: who serves a path holds a lock on PATH.lock. A
// socket that a dead daemon left behind is taken over, one that answers is never touched.
#pragma once

#include <string>

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"
#include "daemon/host/unix_socket_file.hpp"

namespace swarmtalk::daemon {

class ListeningSocket {
 public:
  /// The socket that systemd passed to this process, if it did; else a new one at config.path.
  /// @throws ConfigError  one line naming the key and the remedy: served by a living daemon, no
  ///   such folder, no permission, not a socket, no such group
  static ListeningSocket open(const SocketConfig& config, const KeyLines& lines);

  ListeningSocket(ListeningSocket&& other) noexcept;
  ListeningSocket& operator=(ListeningSocket&&) = delete;
  ~ListeningSocket();

  /// The file is gone: makes a new one, with a new descriptor. @pre !is_from_systemd()
  /// @throws ConfigError  and the old descriptor stays
  void restore(const SocketConfig& config, const KeyLines& lines);

  int descriptor() const { return passed_ >= 0 ? passed_ : file_.descriptor(); }
  const std::string& path() const { return path_; }
  bool is_from_systemd() const { return lock_ < 0; }
  /// Whether a program has connected that nobody has accepted so far.
  bool is_awaited() const;

 private:
  explicit ListeningSocket(const std::string& path);

  void lock(const KeyLines& lines);
  void make(const SocketConfig& config, const KeyLines& lines);

  std::string path_;
  UnixSocketFile file_;
  int passed_ = -1;  // by systemd
  int lock_ = -1;    // -1: systemd's socket, or moved from
};

}  // namespace swarmtalk::daemon
