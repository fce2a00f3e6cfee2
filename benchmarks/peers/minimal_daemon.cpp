// The least that a daemon of this kind can be: system calls only, one thread, one local stream
// socket, one AF_PACKET socket, batches both ways, waiting messages sharing a frame. No channels,
// no parsing, no limits, no loss account: it shows what the system calls cost, for comparison.
//   minimal_daemon INTERFACE SOCKET
#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "benchmarks/peers/minimal.hpp"

namespace {

using namespace peers;

constexpr int kFrames = 64;
constexpr std::size_t kInputBytes = 65536;
constexpr int kClients = 16;

struct Batch {
  unsigned char frames[kFrames][kFrameBytes];
  iovec parts[kFrames];
  mmsghdr headers[kFrames];

  Batch() {
    for (int i = 0; i < kFrames; ++i) {
      parts[i] = {frames[i], kFrameBytes};
      headers[i] = {};
      headers[i].msg_hdr.msg_iov = &parts[i];
      headers[i].msg_hdr.msg_iovlen = 1;
    }
  }
};

struct Client {
  int fd = -1;
  std::size_t size = 0;
  unsigned char input[kInputBytes];
};

Batch received;
Batch sending;
Client clients[kClients];
unsigned char output[kFrames * kFrameBytes];
unsigned char ether_header[kEtherHeaderBytes];
int radio = -1;

[[noreturn]] void die(const char* what) {
  std::perror(what);
  std::exit(1);
}

int open_radio(const char* interface) {
  const int fd = socket(AF_PACKET, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, htons(kEtherType));
  if (fd < 0) die("AF_PACKET");
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(kEtherType);
  address.sll_ifindex = static_cast<int>(if_nametoindex(interface));
  if (bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) die(interface);
  ifreq request{};
  std::strncpy(request.ifr_name, interface, IFNAMSIZ - 1);
  if (ioctl(fd, SIOCGIFHWADDR, &request) != 0) die(interface);
  std::memset(ether_header, 0xFF, 6);
  std::memcpy(ether_header + 6, request.ifr_hwaddr.sa_data, 6);
  const std::uint16_t type = htons(kEtherType);
  std::memcpy(ether_header + 12, &type, 2);
  const int buffer_bytes = 4 << 20;
  setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &buffer_bytes, sizeof buffer_bytes);
  return fd;
}

int listen_at(const char* path) {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path, sizeof address.sun_path - 1);
  if (bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
      listen(fd, kClients) != 0)
    die(path);
  return fd;
}

void send_frames(int count) {
  for (int sent = 0; sent < count;) {
    const int done =
        sendmmsg(radio, sending.headers + sent, static_cast<unsigned>(count - sent), 0);
    if (done > 0) {
      sent += done;
    } else if (errno != EAGAIN && errno != ENOBUFS && errno != EINTR) {
      die("sendmmsg");
    }
  }
}

/// Moves all whole records of a client into frames, as many to a frame as fit.
void transmit(Client& client) {
  int count = 0;
  std::uint32_t used = 0;
  std::size_t at = 0;
  while (at + kSizeBytes <= client.size) {
    std::uint16_t size = 0;
    std::memcpy(&size, client.input + at, kSizeBytes);
    const std::uint32_t record = kSizeBytes + size;
    if (at + record > client.size) break;
    if (used == 0 || used + record > kFrameBytes) {
      if (used != 0) sending.parts[count++].iov_len = used;
      if (count == kFrames) {
        send_frames(count);
        count = 0;
      }
      std::memcpy(sending.frames[count], ether_header, kEtherHeaderBytes);
      used = kEtherHeaderBytes;
    }
    std::memcpy(sending.frames[count] + used, client.input + at, record);
    used += record;
    at += record;
  }
  if (used != 0) sending.parts[count++].iov_len = used;
  send_frames(count);
  client.size -= at;
  std::memmove(client.input, client.input + at, client.size);
}

void on_client(Client& client) {
  for (;;) {
    const ssize_t got =
        recv(client.fd, client.input + client.size, kInputBytes - client.size, MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (got <= 0) {
      close(client.fd);
      client = {};
      client.fd = -1;
      return;
    }
    const bool was_all = client.size + static_cast<std::size_t>(got) < kInputBytes;
    client.size += static_cast<std::size_t>(got);
    transmit(client);
    if (was_all) return;
  }
}

void on_radio() {
  for (;;) {
    for (auto& part : received.parts) part.iov_len = kFrameBytes;
    const int count = recvmmsg(radio, received.headers, kFrames, MSG_DONTWAIT, nullptr);
    if (count <= 0) return;
    std::size_t size = 0;
    for (int i = 0; i < count; ++i) {
      const std::size_t bytes = received.headers[i].msg_len - kEtherHeaderBytes;
      std::memcpy(output + size, received.frames[i] + kEtherHeaderBytes, bytes);
      size += bytes;
    }
    for (const Client& client : clients)
      if (client.fd >= 0 && send(client.fd, output, size, MSG_NOSIGNAL) < 0) std::perror("client");
    if (count < kFrames) return;
  }
}

void on_connection(int listener, int poller) {
  const int fd = accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
  for (Client& client : clients) {
    if (client.fd >= 0) continue;
    client.fd = fd;
    epoll_event event{EPOLLIN, {.ptr = &client}};
    epoll_ctl(poller, EPOLL_CTL_ADD, fd, &event);
    return;
  }
  close(fd);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: minimal_daemon INTERFACE SOCKET\n");
    return 2;
  }
  radio = open_radio(argv[1]);
  int listener = listen_at(argv[2]);
  const int poller = epoll_create1(EPOLL_CLOEXEC);
  epoll_event event{EPOLLIN, {.ptr = &radio}};
  epoll_ctl(poller, EPOLL_CTL_ADD, radio, &event);
  event.data.ptr = &listener;
  epoll_ctl(poller, EPOLL_CTL_ADD, listener, &event);
  for (;;) {
    epoll_event events[kClients];
    const int count = epoll_wait(poller, events, kClients, -1);
    for (int i = 0; i < count; ++i) {
      if (events[i].data.ptr == &radio) {
        on_radio();
      } else if (events[i].data.ptr == &listener) {
        on_connection(listener, poller);
      } else {
        on_client(*static_cast<Client*>(events[i].data.ptr));
      }
    }
  }
}
