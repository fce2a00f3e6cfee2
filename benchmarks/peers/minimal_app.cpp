// The two programs of a run over minimal_daemon; its socket is at MINIMAL_SOCKET.
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <ctime>

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

/// Reads what comes, record by record.
class Input {
 public:
  explicit Input(int fd) : fd_(fd) {}

  /// Waits so long, and reads once. @return false: the end
  template <class OnMessage>
  bool read(std::uint32_t us, const OnMessage& on_message) {
    pollfd waiting{fd_, POLLIN, 0};
    const timespec timeout{us / 1'000'000, static_cast<long>(us % 1'000'000) * 1000};
    if (ppoll(&waiting, 1, &timeout, nullptr) <= 0) return true;
    const ssize_t got = recv(fd_, input_ + have_, sizeof input_ - have_, 0);
    if (got <= 0) return false;
    have_ += static_cast<std::size_t>(got);
    std::size_t at = 0;
    while (at + kSizeBytes <= have_) {
      std::uint16_t size = 0;
      std::memcpy(&size, input_ + at, kSizeBytes);
      if (at + kSizeBytes + size > have_) break;
      on_message(input_ + at + kSizeBytes, size);
      at += kSizeBytes + size;
    }
    have_ -= at;
    std::memmove(input_, input_ + at, have_);
    return true;
  }

 private:
  int fd_;
  unsigned char input_[65536];
  std::size_t have_ = 0;
};

int receive(const Run& run, int fd) {
  Receiver receiver(run);
  receiver.ready();
  static Input input(fd);
  while (!receiver.is_complete() && !receiver.has_stalled()) {
    const bool is_open = input.read(200'000, [&](const unsigned char* bytes, std::size_t size) {
      receiver.on_message(bytes, size);
    });
    if (!is_open) break;
  }
  return receiver.report();
}

class Robot : public Sender {
 public:
  Robot(int fd, SwarmEar& ear) : Sender(fd), input_(fd), ear_(ear) {}
  void listen(std::uint32_t us) {
    const std::int64_t end_ns = now_ns() + std::int64_t{us} * 1000;
    for (std::int64_t now = now_ns(); now < end_ns; now = now_ns()) {
      input_.read(
          static_cast<std::uint32_t>((end_ns - now) / 1000 + 1),
          [&](const unsigned char* bytes, std::size_t size) { ear_.on_message(bytes, size); });
    }
  }

 private:
  Input input_;
  SwarmEar& ear_;
};

int swarm(const Run& run, int fd) {
  SwarmEar ear(run);
  static Robot robot(fd, ear);
  return run_swarm(run, ear, robot);
}

}  // namespace

int main(int argc, char** argv) {
  const Run run = parse(argc, argv);
  const char* path = std::getenv("MINIMAL_SOCKET");
  const int fd = connect_to(path != nullptr ? path : "");
  if (run.is_swarm) return swarm(run, fd);
  if (!run.is_sender) return receive(run, fd);
  Sender sender(fd);
  return run_sender(run, sender);
}
