#include "tests/virtual/air.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>

#include "daemon/station/link_factory.hpp"
#include "drivers/socket/socket_link.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::test {
namespace {

constexpr std::size_t kAddressBytes = 6;  // before each frame
constexpr std::size_t kFrameBytes = 1500;
constexpr std::size_t kDatagramBytes = 2048;

std::uint64_t address_of(std::span<const std::uint8_t> datagram) {
  std::uint64_t address = 0;
  for (std::size_t i = 0; i < kAddressBytes && i < datagram.size(); ++i) {
    address = address << 8 | datagram[i];
  }
  return address;
}

class AirLink final : public drivers::SocketLink {
 public:
  AirLink(boost::asio::io_context& io, int socket, std::uint64_t address,
          const daemon::LinkConfig& config, frame::ProfileId profile, std::size_t max_packet_bytes)
      : SocketLink(io, profile, max_packet_bytes, daemon::pacing_of(config)) {
    use_receive_socket(socket);
    set_limits(kFrameBytes, kDatagramBytes);
    std::array<std::uint8_t, kAddressBytes> header{};
    for (std::uint8_t& byte : header) {
      byte = static_cast<std::uint8_t>(address >> 40);
      address <<= 8;
    }
    transmit_queue().set_medium_header(header);
    set_own_hardware(address_of(header));
  }
  std::string type() const override { return "virtual"; }
  std::string device() const override { return "air"; }

 protected:
  std::optional<std::span<const std::uint8_t>> air_frame(
      const drivers::Datagram& datagram) override {
    return datagram.bytes.subspan(std::min(datagram.bytes.size(), kAddressBytes));
  }
  std::uint64_t hardware_of(const drivers::Datagram& datagram) const override {
    return address_of(datagram.bytes);
  }
  std::size_t medium_header_bytes() const override { return kAddressBytes; }
  void refresh() override { set_state(true, "up"); }
  std::uint64_t kernel_drops() const override { return 0; }
};

}  // namespace

struct Air::Antenna {
  Antenna(boost::asio::io_context& io, int its_robot, Air& air)
      : robot(its_robot),
        socket(loop::Loop::of(io), [this, &air](std::uint32_t) { air.hear(*this); }) {}

  int robot;
  bool is_gone = false;
  loop::Descriptor socket;
};

Air::~Air() = default;

std::unique_ptr<drivers::Link> Air::open(int robot, const daemon::LinkConfig& config,
                                         frame::ProfileId profile, std::size_t max_packet_bytes) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::system_error(errno, std::system_category(), "the air of a virtual swarm");
  }
  std::erase_if(antennas_, [](const auto& each) { return each.second->is_gone; });
  const std::uint64_t address = next_address_++;
  Antenna& antenna =
      *antennas_.emplace(address, std::make_unique<Antenna>(io_, robot, *this)).first->second;
  antenna.socket.own(ends[0]);
  antenna.socket.watch(EPOLLIN);
  return std::make_unique<AirLink>(io_, ends[1], address, config, profile, max_packet_bytes);
}

bool Air::reaches(const Antenna& from, const Antenna& to) {
  if (&from == &to || to.is_gone) return false;
  const Place a = places_[from.robot];
  const Place b = places_[to.robot];
  if (std::hypot(a.x_m - b.x_m, a.y_m - b.y_m) > range_m_) return false;
  return loss_ == 0 || std::uniform_real_distribution<>()(chance_) >= loss_;
}

void Air::hear(Antenna& from) {
  std::array<std::uint8_t, kDatagramBytes> bytes;
  for (;;) {
    const ssize_t size = ::recv(from.socket.fd(), bytes.data(), bytes.size(), 0);
    if (size < 0) return;
    if (size == 0) {  // its robot has ended
      from.is_gone = true;
      return from.socket.watch(0);
    }
    ++frames_sent_;
    course_.add(static_cast<std::uint64_t>(loop::now().time_since_epoch().count()));
    course_.add({bytes.data(), static_cast<std::size_t>(size)});
    for (const auto& [address, to] : antennas_) {
      if (!reaches(from, *to)) continue;
      const ssize_t sent = ::send(to->socket.fd(), bytes.data(), static_cast<std::size_t>(size),
                                  MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent == size) {
        ++frames_heard_;
      } else if (errno == EAGAIN) {
        throw std::logic_error("virtual robot " + std::to_string(to->robot) +
                               ": more frames at one instant than its socket holds");
      }
    }
  }
}

}  // namespace swarmtalk::test
