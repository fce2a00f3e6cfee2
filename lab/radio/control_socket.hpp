// ControlSocket: a Unix socket (SOCK_SEQPACKET) at which the medium's process is asked and told
// things while it runs: each packet is a request, and gets one packet as its answer. Owned by the
// process; never waits. At most kClients at once, others are turned away.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace swarmtalk::lab::radio {

/// Longest request; an answer may have kMaxAnswerBytes.
inline constexpr std::size_t kMaxRequestBytes = 16 * 1024;
inline constexpr std::size_t kMaxAnswerBytes = 1024 * 1024;

class ControlSocket {
 public:
  static constexpr std::size_t kClients = 32;

  /// @throws std::runtime_error  one line: it cannot listen there
  explicit ControlSocket(const std::string& path);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  /// Readable while somebody waits: an epoll descriptor of its own.
  int descriptor() const { return epoll_; }

  /// Takes who has come, answers what was asked.
  void serve(const std::function<std::string(std::string_view request)>& answer);

 private:
  void accept_all();
  void serve_client(int client, const std::function<std::string(std::string_view)>& answer);
  void drop(int client);

  std::string path_;
  int listening_ = -1;
  int epoll_ = -1;
  std::vector<int> clients_;
};

/// The other end: asks the medium at `path` and waits for its answer, at most a few seconds.
/// @throws std::runtime_error  one line: nobody is there, no answer
std::string ask(const std::string& path, const std::string& request);

}  // namespace swarmtalk::lab::radio
