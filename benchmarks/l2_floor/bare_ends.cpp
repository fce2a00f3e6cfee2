#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "benchmarks/l2_floor/ends.hpp"

namespace swarmtalk::l2_floor {
namespace {

constexpr int kReceiveTimeoutSeconds = 5;
constexpr std::size_t kLongestFrameBytes = 9000;

class PacketSocket {
 public:
  explicit PacketSocket(const std::string& interface) {
    // SOCK_DGRAM: the kernel writes the Ethernet header.
    socket_ = socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, htons(kEthertype));
    if (socket_ < 0) fail("a packet socket (needs root)");
    address_.sll_family = AF_PACKET;
    address_.sll_protocol = htons(kEthertype);
    address_.sll_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    if (address_.sll_ifindex == 0) fail("interface " + interface);
    const int on = 1;
    setsockopt(socket_, SOL_PACKET, PACKET_IGNORE_OUTGOING, &on, sizeof on);
    const timeval timeout{kReceiveTimeoutSeconds, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    if (bind(socket_, reinterpret_cast<sockaddr*>(&address_), sizeof address_) != 0) fail("bind");
    address_.sll_halen = 6;
    std::memset(address_.sll_addr, 0xFF, 6);
  }
  ~PacketSocket() { close(socket_); }
  PacketSocket(const PacketSocket&) = delete;
  PacketSocket& operator=(const PacketSocket&) = delete;

  void send(std::span<const std::uint8_t> message) {
    while (sendto(socket_, message.data(), message.size(), 0,
                  reinterpret_cast<sockaddr*>(&address_), sizeof address_) < 0) {
      if (errno != ENOBUFS && errno != EINTR) fail("send");
    }
  }

  ssize_t receive(std::span<std::uint8_t> buffer) {
    return recv(socket_, buffer.data(), buffer.size(), 0);
  }

 private:
  [[noreturn]] static void fail(const std::string& what) {
    throw std::runtime_error(what + ": " + std::strerror(errno));
  }

  int socket_ = -1;
  sockaddr_ll address_{};
};

class BareSender final : public Sender {
 public:
  explicit BareSender(const std::string& interface) : socket_(interface) {}

  void send(std::size_t message_bytes) override {
    message_.resize(message_bytes);
    stamp(message_);
    socket_.send(message_);
  }

  void wait_until(std::int64_t time_ns) override {
    const timespec time{time_ns / 1'000'000'000, time_ns % 1'000'000'000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
    }
  }

 private:
  PacketSocket socket_;
  std::vector<std::uint8_t> message_;
};

class BareReceiver final : public Receiver {
 public:
  explicit BareReceiver(const std::string& interface) : socket_(interface) {}

  void receive(const std::function<bool(std::span<const std::uint8_t>)>& on_message) override {
    std::array<std::uint8_t, kLongestFrameBytes> buffer;
    for (;;) {
      const ssize_t size = socket_.receive(buffer);
      if (size < 0) return;
      if (!on_message({buffer.data(), static_cast<std::size_t>(size)})) return;
    }
  }

 private:
  PacketSocket socket_;
};

}  // namespace

std::unique_ptr<Sender> open_bare_sender(const std::string& interface) {
  return std::make_unique<BareSender>(interface);
}

std::unique_ptr<Receiver> open_bare_receiver(const std::string& interface) {
  return std::make_unique<BareReceiver>(interface);
}

}  // namespace swarmtalk::l2_floor
