#include "lab/radio/control_socket.hpp"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace swarmtalk::lab::radio {
namespace {

constexpr int kAnswerTimeoutS = 10;
constexpr int kSendBufferBytes = 2 * static_cast<int>(kMaxAnswerBytes);

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    throw std::runtime_error(path + " is too long for a socket; use a shorter --name");
  }
  path.copy(address.sun_path, path.size());
  return address;
}

bool watch(int epoll, int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  return epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event) == 0;
}

/// A descriptor that is closed at the end of a scope.
struct Closing {
  int fd;
  ~Closing() { close(fd); }
};

}  // namespace

ControlSocket::ControlSocket(const std::string& path) : path_(path) {
  const sockaddr_un address = address_of(path);
  listening_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  epoll_ = epoll_create1(EPOLL_CLOEXEC);
  unlink(path.c_str());
  if (listening_ < 0 || epoll_ < 0 ||
      bind(listening_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listening_, kClients) != 0 || !watch(epoll_, listening_)) {
    const std::string why = std::strerror(errno);
    if (listening_ >= 0) close(listening_);
    if (epoll_ >= 0) close(epoll_);
    throw std::runtime_error("cannot listen at " + path + ": " + why);
  }
}

ControlSocket::~ControlSocket() {
  for (const int client : clients_) close(client);
  close(listening_);
  close(epoll_);
  unlink(path_.c_str());
}

void ControlSocket::serve(const std::function<std::string(std::string_view)>& answer) {
  std::array<epoll_event, 16> events{};
  const int count = epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), 0);
  for (int i = 0; i < count; ++i) {
    const int fd = events[static_cast<std::size_t>(i)].data.fd;
    if (fd == listening_) {
      accept_all();
    } else {
      serve_client(fd, answer);
    }
  }
}

void ControlSocket::accept_all() {
  for (int client = 0;
       (client = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK)) >= 0;) {
    setsockopt(client, SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
    if (clients_.size() < kClients && watch(epoll_, client)) {
      clients_.push_back(client);
    } else {
      close(client);
    }
  }
}

void ControlSocket::serve_client(int client,
                                 const std::function<std::string(std::string_view)>& answer) {
  std::array<char, kMaxRequestBytes> request;
  const ssize_t size = recv(client, request.data(), request.size(), 0);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (size <= 0) return drop(client);
  const std::string text = answer({request.data(), static_cast<std::size_t>(size)});
  // A client that does not read its answers is not waited for.
  if (send(client, text.data(), text.size(), MSG_NOSIGNAL) < 0) drop(client);
}

void ControlSocket::drop(int client) {
  close(client);
  std::erase(clients_, client);
}

std::string ask(const std::string& path, const std::string& request) {
  const sockaddr_un address = address_of(path);
  const Closing client{socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0)};
  const timeval limit{kAnswerTimeoutS, 0};
  setsockopt(client.fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  if (connect(client.fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    throw std::runtime_error("the medium does not listen at " + path + ": " + std::strerror(errno));
  }
  std::string text(kMaxAnswerBytes, 0);
  if (send(client.fd, request.data(), request.size(), MSG_NOSIGNAL) < 0) {
    throw std::runtime_error(std::string("asking the medium: ") + std::strerror(errno));
  }
  const ssize_t size = recv(client.fd, text.data(), text.size(), 0);
  if (size <= 0) {
    throw std::runtime_error("the medium at " + path + " does not answer within " +
                             std::to_string(kAnswerTimeoutS) + " s");
  }
  text.resize(static_cast<std::size_t>(size));
  return text;
}

}  // namespace swarmtalk::lab::radio
