#include "lab/radio/tap.hpp"

#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <stdexcept>

namespace swarmtalk::lab::radio {
namespace {

[[noreturn]] void fail(const std::string& what) {
  const int error = errno;
  throw std::runtime_error(what + ": " + std::strerror(error));
}

/// In a network namespace until it is destroyed.
class Inside {
 public:
  explicit Inside(const std::string& network_namespace)
      : own_(open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC)) {
    const std::string path = "/run/netns/" + network_namespace;
    const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    const bool is_inside = own_ >= 0 && fd >= 0 && setns(fd, CLONE_NEWNET) == 0;
    const int error = errno;
    if (fd >= 0) close(fd);
    if (!is_inside) {
      if (own_ >= 0) close(own_);
      errno = error;
      fail("entering " + path);
    }
  }
  ~Inside() {
    // It cannot fail: the descriptor is a namespace's, and we had the right a moment ago.
    [[maybe_unused]] const int result = setns(own_, CLONE_NEWNET);
    close(own_);
  }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

 private:
  int own_;
};

ifreq request_for(const std::string& interface) {
  ifreq request{};
  interface.copy(request.ifr_name, IFNAMSIZ - 1);
  return request;
}

void set_address(int socket, const std::string& interface, std::uint16_t number) {
  ifreq request = request_for(interface);
  request.ifr_hwaddr.sa_family = ARPHRD_ETHER;
  // Locally administered; "ST" behind it.
  const std::array<unsigned char, 6> address{0x02,
                                             0x53,
                                             0x54,
                                             0,
                                             static_cast<unsigned char>(number >> 8),
                                             static_cast<unsigned char>(number & 0xFF)};
  std::memcpy(request.ifr_hwaddr.sa_data, address.data(), address.size());
  if (ioctl(socket, SIOCSIFHWADDR, &request) != 0) fail("setting the address of " + interface);
}

void switch_on(int socket, const std::string& interface) {
  ifreq request = request_for(interface);
  if (ioctl(socket, SIOCGIFFLAGS, &request) != 0) fail("reading the flags of " + interface);
  request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP);
  if (ioctl(socket, SIOCSIFFLAGS, &request) != 0) fail("switching on " + interface);
}

}  // namespace

Tap::Tap(const std::string& network_namespace, const std::string& interface, std::uint16_t number)
    : interface_(interface) {
  const Inside inside(network_namespace);
  fd_ = open("/dev/net/tun", O_RDWR | O_CLOEXEC | O_NONBLOCK);
  if (fd_ < 0) fail("/dev/net/tun");
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  try {
    ifreq request = request_for(interface);
    request.ifr_flags = IFF_TAP | IFF_NO_PI;
    if (ioctl(fd_, TUNSETIFF, &request) != 0) {
      fail("making interface " + interface + " in " + network_namespace);
    }
    if (socket < 0) fail("opening a socket");
    set_address(socket, interface, number);
    switch_on(socket, interface);
    counters_fd_ = open("/proc/thread-self/net/dev", O_RDONLY | O_CLOEXEC);
  } catch (...) {
    if (socket >= 0) close(socket);
    close(fd_);
    throw;
  }
  close(socket);
}

Tap::~Tap() {
  if (fd_ >= 0) close(fd_);
  if (counters_fd_ >= 0) close(counters_fd_);
}

std::size_t Tap::read(std::span<std::uint8_t> buffer) {
  const ssize_t size = ::read(fd_, buffer.data(), buffer.size());
  return size > 0 ? static_cast<std::size_t>(size) : 0;
}

bool Tap::write(std::span<const std::uint8_t> frame) {
  return ::write(fd_, frame.data(), frame.size()) == static_cast<ssize_t>(frame.size());
}

std::uint64_t Tap::dropped_frames() const {
  std::array<char, 4096> text{};
  const ssize_t size = counters_fd_ >= 0 ? pread(counters_fd_, text.data(), text.size(), 0) : 0;
  std::istringstream lines(
      std::string(text.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0))));
  for (std::string line; std::getline(lines, line);) {
    const auto colon = line.find(interface_ + ":");
    if (colon == std::string::npos) continue;
    // Eight columns of reception, then bytes, packets, errors and drops of transmission.
    std::istringstream fields(line.substr(colon + interface_.size() + 1));
    std::uint64_t value = 0;
    for (int field = 0; field < 12; ++field) fields >> value;
    return fields ? value : 0;
  }
  return 0;
}

}  // namespace swarmtalk::lab::radio
