// The two programs of a run over minimal_daemon; its socket is at MINIMAL_SOCKET.
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "benchmarks/peers/minimal.hpp"
#include "benchmarks/peers/window.hpp"

namespace {

using namespace peers;

int connect_to(const char* path) {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path, sizeof address.sun_path - 1);
  if (connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    std::perror(path);
    std::exit(1);
  }
  return fd;
}

class Sender {
 public:
  explicit Sender(int fd) : fd_(fd) {}
  bool send(const char* bytes, std::size_t size) {
    const auto prefix = static_cast<std::uint16_t>(size);
    std::memcpy(record_, &prefix, kSizeBytes);
    std::memcpy(record_ + kSizeBytes, bytes, size);
    return ::send(fd_, record_, kSizeBytes + size, MSG_NOSIGNAL) >= 0;
  }
  void wait(std::uint32_t us) { usleep(us); }
  void flush() {}

 private:
  int fd_;
  char record_[kSizeBytes + 65535];
};

int receive(const Run& run, int fd) {
  Receiver receiver(run);
  receiver.ready();
  static unsigned char input[65536];
  std::size_t have = 0;
  while (!receiver.is_complete() && !receiver.has_stalled()) {
    pollfd waiting{fd, POLLIN, 0};
    if (poll(&waiting, 1, 200) <= 0) continue;
    const ssize_t got = recv(fd, input + have, sizeof input - have, 0);
    if (got <= 0) break;
    have += static_cast<std::size_t>(got);
    std::size_t at = 0;
    while (at + kSizeBytes <= have) {
      std::uint16_t size = 0;
      std::memcpy(&size, input + at, kSizeBytes);
      if (at + kSizeBytes + size > have) break;
      receiver.on_message(input + at + kSizeBytes, size);
      at += kSizeBytes + size;
    }
    have -= at;
    std::memmove(input, input + at, have);
  }
  return receiver.report();
}

}  // namespace

int main(int argc, char** argv) {
  const Run run = parse(argc, argv);
  const char* path = std::getenv("MINIMAL_SOCKET");
  const int fd = connect_to(path != nullptr ? path : "");
  if (!run.is_sender) return receive(run, fd);
  Sender sender(fd);
  return run_sender(run, sender);
}
