#include "client_lib/connection.hpp"

#include <fcntl.h>
#include <glob.h>
#include <grp.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "client_lib/descriptors.hpp"
#include "client_lib/waiting.hpp"
#include "ipc/stream.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::client {
namespace {

constexpr std::size_t kReadBytes = 64 * 1024;

Status lost(const std::string& why) {
  return Status(StatusCode::kDisconnected, "lost swarmtalkd: " + why + "; reconnecting");
}

/// connect() refuses a file of another kind with the error of a socket without a listener.
bool is_other_file(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && !S_ISSOCK(status.st_mode);
}

/// What helps a user who may not write to this socket.
std::string who_may_connect(const std::string& path) {
  if (::faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) == 0) {
    return "this user may use it, so something else confines the program (a container, a snap, "
           "AppArmor, SELinux, or the sandbox of a unit): allow it this socket there";
  }
  struct stat its {};
  std::string group = "swarmtalk";
  if (::stat(path.c_str(), &its) == 0) {
    const ::group* own = ::getgrgid(its.st_gid);
    if (its.st_gid == 0 || (its.st_mode & S_IWGRP) == 0 || own == nullptr) {
      const ::passwd* user = ::getpwuid(its.st_uid);
      const std::string name =
          user != nullptr ? user->pw_name : "uid " + std::to_string(its.st_uid);
      return "it is for " + name + " alone: run the program as " + name +
             (its.st_uid == 0 ? " (sudo)" : "") +
             ", or name a group for it, group under [socket] of the daemon's configuration";
    }
    group = own->gr_name;
  } else if (errno == EACCES && path != ipc::kDefaultSocketPath) {
    return "its folder is closed to this user: run the program as the user who started swarmtalkd "
           "(sudo, if that is root)";
  }
  return "join group " + group + ": sudo usermod -aG " + group + " $USER, then log in again";
}

/// The name of a lab of which swarmtalk-lab keeps a folder there, as lab/state.cpp says: that in
/// SWARMTALK_LAB, else the usual one, else any; empty: there is none.
std::string lab_in(const std::string& base) {
  const char* const named = std::getenv("SWARMTALK_LAB");
  const bool is_named = named != nullptr && *named != '\0';
  const std::string usual = is_named ? named : "lab";
  if (::access((base + "/" + usual + "/lab.json").c_str(), F_OK) == 0) return usual;
  if (is_named) return "";
  std::string found;
  ::glob_t files{};
  if (::glob((base + "/*/lab.json").c_str(), 0, nullptr, &files) == 0) {
    const std::string path = files.gl_pathv[0];
    const std::size_t end = path.rfind('/');
    found = path.substr(base.size() + 1, end - base.size() - 1);
  }
  ::globfree(&files);
  return found;
}

/// What helps where the socket of the installed daemon is missing. A program that was meant for a
/// robot of a lab ran beside it.
std::string how_to_start() {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  std::string lab = lab_in("/tmp/swarmtalk-lab-" + std::to_string(::geteuid()));
  if (lab.empty() && runtime != nullptr) lab = lab_in(std::string(runtime) + "/swarmtalk-lab");
  const bool is_of_root = lab.empty();
  if (is_of_root) lab = lab_in("/run/swarmtalk-lab");
  if (lab.empty()) return "start it with: systemctl start swarmtalkd";
  const bool is_usual = lab == "lab" || std::getenv("SWARMTALK_LAB") != nullptr;
  return std::string("a lab is up, and as its robot 1 a program runs with: ") +
         (is_of_root && ::geteuid() != 0 ? "sudo " : "") + "swarmtalk-lab " +
         (is_usual ? "" : "--name " + lab + " ") + "exec 1 -- PROGRAM";
}

}  // namespace

Status connect_error(int error, const std::string& path) {
  const bool is_standard = path == ipc::kDefaultSocketPath;
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return Status(StatusCode::kNoDaemon,
                    "cannot reach swarmtalkd: " + path + " does not exist; " +
                        (is_standard ? how_to_start() : "start swarmtalkd for that socket"));
    case ECONNREFUSED:
      return Status(StatusCode::kDaemonDead,
                    "cannot reach swarmtalkd: " + path +
                        " is there but nobody listens, so the daemon has died; " +
                        (is_standard ? "start it with: systemctl restart swarmtalkd"
                                     : "start swarmtalkd for that socket"));
    case ENOTSOCK:
    case EPROTOTYPE:
      return Status(StatusCode::kNoDaemon,
                    "cannot reach swarmtalkd: " + path + " is not a socket of swarmtalkd");
    case EACCES:
    case EPERM:
      return Status(StatusCode::kNoPermission,
                    "no permission for " + path + "; " + who_may_connect(path));
    case EAGAIN:
      return Status(
          StatusCode::kTimeout,
          "swarmtalkd at " + path + " accepts no connections; it is stopped or overloaded");
    default:
      return Status(StatusCode::kSystem, "cannot connect to " + path + ": " + std::strerror(error));
  }
}

std::string socket_path(const std::string& configured) {
  if (!configured.empty()) return configured;
  const char* variable = std::getenv(ipc::kSocketVariable);
  return variable != nullptr && *variable != '\0' ? variable : ipc::kDefaultSocketPath;
}

Status Connection::open(const std::string& path) {
  close();
  if (path.size() >= sizeof(sockaddr_un::sun_path)) {
    return Status(StatusCode::kBadArgument, "socket path longer than " +
                                                std::to_string(sizeof(sockaddr_un::sun_path) - 1) +
                                                " bytes: " + path);
  }
  fd_ = above_standard_streams(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (fd_ < 0) {
    return Status(StatusCode::kSystem, std::string("cannot open a socket: ") + strerror(errno));
  }
  int error = ipc::connect_stream(fd_, path);
  if (error == 0) return Status();
  close();
  if (error == ECONNREFUSED && is_other_file(path)) error = ENOTSOCK;
  return connect_error(error, path);
}

void Connection::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
  reader_.clear();
  outgoing_.clear();
  loss_ = Status();
}

Status Connection::flush() {
  if (!loss_ || !is_open()) return loss_;
  std::size_t written = 0;
  while (written < outgoing_.size()) {
    const ssize_t count = ipc::write_stream(fd_, std::string_view(outgoing_).substr(written));
    if (count < 0) {
      if (errno != EAGAIN) loss_ = lost(std::strerror(errno));
      break;
    }
    written += static_cast<std::size_t>(count);
  }
  outgoing_.erase(0, written);
  return loss_;
}

bool Connection::flush_until(std::chrono::steady_clock::time_point deadline) {
  while (fd_ >= 0 && flush() && has_outgoing() && loop::now() < deadline) {
    pollfd descriptor{fd_, POLLOUT, 0};
    wait_for({&descriptor, 1}, deadline);
  }
  return !has_outgoing();
}

Status Connection::receive() {
  const auto room = reader_.prepare(kReadBytes);
  const ssize_t count = ipc::read_stream(fd_, room);
  may_have_more_ = count == static_cast<ssize_t>(room.size());
  if (count == 0) return lost("it closed the connection");
  if (count < 0) return errno == EAGAIN ? Status() : lost(std::strerror(errno));
  reader_.commit(static_cast<std::size_t>(count));
  return Status();
}

}  // namespace swarmtalk::client
