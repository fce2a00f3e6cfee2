#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "lab/radio/ghost_door.hpp"
#include "suite/sim/ghost_air.hpp"
#include "suite/sim/ghost_ethernet.hpp"

namespace swarmtalk::suite {
namespace {

constexpr int kDoorTimeoutS = 5;

class MediumAir final : public GhostAir {
 public:
  explicit MediumAir(const std::string& control_socket)
      : door_(lab::radio::ghost_door_of(control_socket)), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
    if (epoll_ < 0) throw std::runtime_error("out of descriptors");
  }
  ~MediumAir() override {
    for (const Seat& seat : seats_) close(seat.fd);
    close(epoll_);
  }
  MediumAir(const MediumAir&) = delete;
  MediumAir& operator=(const MediumAir&) = delete;

  void add(double x_mm, double y_mm) override {
    const int fd = connect_to_door();
    seats_.push_back({fd, 0, 0});
    tell_place(fd, x_mm, y_mm);
    std::array<char, 256> text{};
    const ssize_t size = recv(fd, text.data(), text.size(), 0);
    const auto told = size > 0
                          ? nlohmann::json::parse(text.data(), text.data() + size, nullptr, false)
                          : nlohmann::json();
    if (!told.is_object()) {
      throw std::runtime_error("the medium lets no more ghosts in; at most " +
                               std::to_string(lab::radio::kMostGhosts) + " at once");
    }
    seats_.back().number = told.at("robot").get<uint16_t>();
    seats_.back().header_bytes = told.at("header_bytes").get<std::size_t>();
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u32 = static_cast<uint32_t>(seats_.size() - 1);
    epoll_ctl(epoll_, EPOLL_CTL_ADD, fd, &event);
  }

  void move(uint32_t ghost, double x_mm, double y_mm) override {
    tell_place(seats_[ghost].fd, x_mm, y_mm);
  }

  bool send(uint32_t ghost, std::span<const uint8_t> frame) override {
    const Seat& seat = seats_[ghost];
    std::array<uint8_t, lab::radio::kMaxFrameBytes> buffer;
    if (seat.header_bytes + frame.size() > buffer.size()) return false;
    if (seat.header_bytes == kEthernetBytes) put_ethernet(buffer, seat.number);
    std::memcpy(buffer.data() + seat.header_bytes, frame.data(), frame.size());
    const std::size_t size = seat.header_bytes + frame.size();
    return ::send(seat.fd, buffer.data(), size, MSG_DONTWAIT | MSG_NOSIGNAL) ==
           static_cast<ssize_t>(size);
  }

  int descriptor() const override { return epoll_; }

  void receive(const Hear& hear) override {
    std::array<epoll_event, 64> events{};
    const int count = epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), 0);
    for (int i = 0; i < count; ++i) drain(events[static_cast<std::size_t>(i)].data.u32, hear);
  }

 private:
  struct Seat {
    int fd;
    uint16_t number;  // of the medium
    std::size_t header_bytes;
  };

  static void tell_place(int fd, double x_mm, double y_mm) {
    const std::string place = nlohmann::json{{"x_m", x_mm / 1000}, {"y_m", y_mm / 1000}}.dump();
    ::send(fd, place.data(), place.size(), MSG_NOSIGNAL);  // if it fails, receive() finds out
  }

  int connect_to_door() const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (door_.size() >= sizeof address.sun_path) throw std::runtime_error(door_ + " is too long");
    door_.copy(address.sun_path, door_.size());
    const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    const timeval limit{kDoorTimeoutS, 0};
    if (fd >= 0 && setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit) == 0 &&
        connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
      return fd;
    }
    const std::string why = std::strerror(errno);
    if (fd >= 0) close(fd);
    throw std::runtime_error("no radio of a lab at " + door_ + ": " + why +
                             "; SWARMTALK_MEDIUM names it in commands of swarmtalk-lab "
                             "--medium radio");
  }

  void drain(uint32_t ghost, const Hear& hear) const {
    constexpr int kFrames = 64;
    std::array<uint8_t, lab::radio::kMaxFrameBytes> buffer;
    for (int i = 0; i < kFrames; ++i) {
      const ssize_t size = recv(seats_[ghost].fd, buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
      if (size <= 0) throw std::runtime_error("the medium has gone");
      const auto whole = static_cast<std::size_t>(size);
      if (whole <= seats_[ghost].header_bytes) continue;
      hear(ghost, std::span(buffer).first(whole).subspan(seats_[ghost].header_bytes));
    }
  }

  std::string door_;
  int epoll_;
  std::vector<Seat> seats_;  // by ghost
};

}  // namespace

std::unique_ptr<GhostAir> join_medium(const std::string& control_socket) {
  return std::make_unique<MediumAir>(control_socket);
}

std::unique_ptr<GhostAir> join_air(const std::string& target, double range_mm) {
  if (target.find('/') != std::string::npos) return join_medium(target);
  return join_interface(target, range_mm);
}

}  // namespace swarmtalk::suite
