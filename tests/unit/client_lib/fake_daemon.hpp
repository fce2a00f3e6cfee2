// A daemon that says what a test tells it to, on a real Unix socket, on a thread of its own. Every
// public function runs on that thread and returns when it is done.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "ipc/framing.hpp"

namespace swarmtalk::test {

inline bool is_publish(const ipc::Envelope& envelope) {
  return envelope.has_publish();
}

class FakeDaemon {
 public:
  explicit FakeDaemon(std::string path);
  ~FakeDaemon();

  /// Like kill -9: connections die, the socket file stays.
  void kill();
  /// Listens again after kill().
  void restart();

  /// How it answers; set before the client asks.
  std::uint32_t major = ipc::kProtocolMajor;
  bool says_hello = true;
  ipc::Failure refuse_clients;  // code set: each client is told this and closed, unread
  bool answers_requests = true;
  bool answers_publish = true;
  std::uint32_t max_message_bytes = 100;
  std::optional<bool> is_timestamped;  // said of every channel that is advertised; none: not told
  ipc::Failure refuse_channels;        // code set: every subscribe and advertise is refused so
  /// What it says to a request, the answer first; nothing: what it would say without this.
  std::function<std::vector<ipc::Envelope>(const ipc::Envelope&)> says;

  /// From now on every publication is refused so; ERROR_UNSPECIFIED: none.
  void refuse_messages(ipc::ErrorCode code, const std::string& text);

  /// Sends a message to every subscription. Fields but the id are taken from `deliver`.
  void deliver(const ipc::Deliver& deliver);
  void deliver(const std::string& payload);
  void send_raw(const std::string& bytes);
  void answer_publish();  // `sent` for the newest publication

  std::vector<ipc::Envelope> received();
  int count(const std::function<bool(const ipc::Envelope&)>& matches);
  int reads();  // recv() calls that returned something

 private:
  struct Peer {
    int fd;
    ipc::FrameReader reader;
    std::vector<std::uint32_t> subscriptions;
  };

  void loop();
  void listen_here();
  void close_all();
  void on_thread(const std::function<void()>& task);
  void read_peer(Peer& peer);
  void handle(Peer& peer, const ipc::Envelope& envelope);
  void reply(Peer& peer, ipc::Envelope& envelope);
  std::uint32_t number_of(const ipc::Channel& channel);

  const std::string path_;
  int listen_fd_ = -1;
  int wake_fd_ = -1;
  std::vector<std::unique_ptr<Peer>> peers_;
  std::vector<ipc::Envelope> received_;
  int reads_ = 0;
  std::uint32_t last_id_ = 0;
  std::map<std::string, std::uint32_t> numbers_;  // of channels, by what was asked for
  ipc::Failure refuse_messages_;
  std::mutex mutex_;
  std::condition_variable done_;
  const std::function<void()>* task_ = nullptr;
  bool is_ending_ = false;
  std::thread thread_;
};

/// A socket path of this test in a folder of its own.
std::string test_socket_path();

}  // namespace swarmtalk::test
