// UnixSocketFile: a Unix socket with its place in the file system. It takes over what a dead
// program left there and nothing else, gives the new file its mode and group before anybody can
// connect, and removes at the end what it made. Used by ListeningSocket and PoseSocket.
#pragma once

#include <sys/types.h>

#include <string>
#include <utility>

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"

namespace swarmtalk::daemon {

/// What differs between the daemon's sockets.
struct SocketKind {
  int type;                // SOCK_STREAM, SOCK_DGRAM
  const char* key;         // of the configuration, blamed for what cannot be
  const char* is_used_by;  // "is served by a running swarmtalkd"
  const char* is_it_used;  // "whether a program serves"
};

class UnixSocketFile {
 public:
  UnixSocketFile(std::string path, const SocketKind& kind) : path_(std::move(path)), kind_(&kind) {}
  UnixSocketFile(UnixSocketFile&& other) noexcept;
  UnixSocketFile& operator=(UnixSocketFile&& other) noexcept;
  ~UnixSocketFile();

  /// Makes the file, bound to a new, non-blocking descriptor. When that fails nothing has changed.
  /// @throws ConfigError  one line naming the key and the remedy: used by a living program, no such
  ///   folder, no permission, not a socket, no such group
  void open(const SocketConfig& access, const KeyLines& lines);

  /// -1: not open, or released.
  int descriptor() const { return descriptor_; }
  /// The descriptor is the caller's from now on; the file stays ours.
  int release();
  const std::string& path() const { return path_; }

  struct Answer {
    int error;  // of connect(); 0: somebody answers
    pid_t pid;  // who, if known
  };
  /// Asks whether somebody uses the file.
  Answer probe() const;
  /// That somebody does, with the remedy.
  std::string taken(pid_t pid) const;
  /// What an errno at `path` means to a person, with the remedy.
  static std::string explain(const std::string& path, int error);

 private:
  void remove_stale(const KeyLines& lines) const;
  void set_access(const SocketConfig& access, gid_t group, const KeyLines& lines) const;
  void remove_own();

  std::string path_;
  const SocketKind* kind_;
  int descriptor_ = -1;
  dev_t device_ = 0;
  ino_t inode_ = 0;  // 0: no file of ours
};

}  // namespace swarmtalk::daemon
