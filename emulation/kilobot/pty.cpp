#include "emulation/kilobot/pty.hpp"

#include <fcntl.h>
#include <pty.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace swarmtalk::emulator {

Pty::Pty(const std::string& link_path) : link_path_(link_path) {
  if (::openpty(&master_, &slave_, nullptr, nullptr, nullptr) != 0)
    throw std::runtime_error(std::string("cannot make a pseudo terminal: ") + strerror(errno));
  std::array<char, 128> name{};
  if (const int error = ::ttyname_r(slave_, name.data(), name.size()); error != 0)
    throw std::runtime_error(std::string("a pseudo terminal has no name: ") + strerror(error));
  device_ = name.data();
  termios settings{};
  ::tcgetattr(slave_, &settings);
  ::cfmakeraw(&settings);
  ::cfsetspeed(&settings, B38400);
  ::tcsetattr(slave_, TCSANOW, &settings);
  ::fcntl(master_, F_SETFL, O_NONBLOCK);
  ::fcntl(master_, F_SETFD, FD_CLOEXEC);
  ::fcntl(slave_, F_SETFD, FD_CLOEXEC);
  if (link_path_.empty()) return;
  struct stat status {};
  if (::lstat(link_path_.c_str(), &status) == 0 && S_ISLNK(status.st_mode))
    ::unlink(link_path_.c_str());
  if (::symlink(device_.c_str(), link_path_.c_str()) != 0) {
    const int error = errno;
    ::close(master_);
    ::close(slave_);
    throw std::runtime_error(link_path_ + ": cannot be linked to the terminal: " + strerror(error));
  }
}

Pty::~Pty() {
  if (!link_path_.empty()) ::unlink(link_path_.c_str());
  ::close(master_);
  ::close(slave_);
}

std::size_t Pty::read_into(std::vector<std::uint8_t>& bytes, std::size_t limit) {
  std::array<std::uint8_t, 4096> buffer{};
  const ssize_t count = ::read(master_, buffer.data(), std::min(limit, buffer.size()));
  if (count <= 0) return 0;
  bytes.insert(bytes.end(), buffer.begin(), buffer.begin() + count);
  return static_cast<std::size_t>(count);
}

void Pty::write(std::span<const std::uint8_t> bytes) {
  const ssize_t count = ::write(master_, bytes.data(), bytes.size());
  dropped_bytes_ += bytes.size() - static_cast<std::size_t>(count > 0 ? count : 0);
}

}  // namespace swarmtalk::emulator
