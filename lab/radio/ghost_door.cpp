#include "lab/radio/ghost_door.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace swarmtalk::lab::radio {
namespace {

constexpr double kFarthestGhostM = 100000;
constexpr int kGhostBufferBytes = 256 * 1024;

}  // namespace

std::string ghost_door_of(const std::string& control_path) {
  return control_path + ".ghosts";
}

std::optional<GhostPlace> read_ghost_place(std::string_view packet) {
  const nlohmann::json place = nlohmann::json::parse(packet, nullptr, false);
  if (!place.is_object()) return std::nullopt;
  const auto x = place.find("x_m");
  const auto y = place.find("y_m");
  if (x == place.end() || y == place.end() || !x->is_number() || !y->is_number()) {
    return std::nullopt;
  }
  const GhostPlace found{x->get<double>(), y->get<double>()};
  const bool is_near =
      std::fabs(found.x_m) <= kFarthestGhostM && std::fabs(found.y_m) <= kFarthestGhostM;
  return is_near ? std::optional(found) : std::nullopt;
}

GhostPort::~GhostPort() {
  close(fd_);
}

std::size_t GhostPort::read(std::span<std::uint8_t> buffer) {
  const ssize_t size = recv(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) is_gone_ = true;
  return size > 0 ? static_cast<std::size_t>(size) : 0;
}

bool GhostPort::write(std::span<const std::uint8_t> frame) {
  return send(fd_, frame.data(), frame.size(), MSG_DONTWAIT | MSG_NOSIGNAL) ==
         static_cast<ssize_t>(frame.size());
}

GhostDoor::GhostDoor(const std::string& path) : path_(path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    throw std::runtime_error(path + " is too long for a socket; use a shorter --name");
  }
  path.copy(address.sun_path, path.size());
  listening_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  unlink(path.c_str());
  if (listening_ < 0 ||
      bind(listening_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listening_, kMostGhosts) != 0) {
    const std::string why = std::strerror(errno);
    if (listening_ >= 0) close(listening_);
    throw std::runtime_error("cannot listen at " + path + ": " + why);
  }
}

GhostDoor::~GhostDoor() {
  close(listening_);
  unlink(path_.c_str());
}

std::unique_ptr<GhostPort> GhostDoor::accept() {
  const int fd = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return nullptr;
  setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &kGhostBufferBytes, sizeof kGhostBufferBytes);
  return std::make_unique<GhostPort>(fd);
}

}  // namespace swarmtalk::lab::radio
