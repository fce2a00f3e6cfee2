// The two programs of a run with nothing between them and the wire: one frame a message. The
// interface is named by BARE_INTERFACE.
#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "benchmarks/peers/minimal.hpp"
#include "benchmarks/peers/window.hpp"

namespace {

using namespace peers;

constexpr std::uint16_t kBareType = 0x88B5;

sockaddr_ll broadcast(const char* interface) {
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(kBareType);
  address.sll_ifindex = static_cast<int>(if_nametoindex(interface));
  address.sll_halen = 6;
  std::memset(address.sll_addr, 0xFF, 6);
  return address;
}

class Sender {
 public:
  Sender(int fd, const sockaddr_ll& to) : fd_(fd), to_(to) {}
  bool send(const char* bytes, std::size_t size) {
    return sendto(fd_, bytes, size, 0, reinterpret_cast<const sockaddr*>(&to_), sizeof to_) >= 0;
  }
  void wait(std::uint32_t us) { usleep(us); }
  void flush() {}

 private:
  int fd_;
  sockaddr_ll to_;
};

int receive(const Run& run, int fd) {
  Receiver receiver(run);
  receiver.ready();
  char bytes[2048];
  while (!receiver.is_complete() && !receiver.has_stalled()) {
    pollfd waiting{fd, POLLIN, 0};
    if (poll(&waiting, 1, 200) <= 0) continue;
    const ssize_t got = recv(fd, bytes, sizeof bytes, 0);
    if (got > 0) receiver.on_message(bytes, run.size_bytes);
  }
  return receiver.report();
}

}  // namespace

int main(int argc, char** argv) {
  const Run run = parse(argc, argv);
  if (run.is_swarm) return 2;  // is not measured
  const char* interface = std::getenv("BARE_INTERFACE");
  const int fd = socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, htons(kBareType));
  const sockaddr_ll address = broadcast(interface != nullptr ? interface : "");
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    std::perror("BARE_INTERFACE");
    return 1;
  }
  const int buffer_bytes = 4 << 20;
  setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &buffer_bytes, sizeof buffer_bytes);
  if (!run.is_sender) return receive(run, fd);
  Sender sender(fd, address);
  return run_sender(run, sender);
}
