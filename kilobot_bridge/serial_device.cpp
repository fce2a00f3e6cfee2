#include "kilobot_bridge/serial_device.hpp"

#include <asm/termbits.h>  // termios2: any baud rate
#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace swarmtalk::kilobot_bridge {
namespace {

constexpr const char* kInUse =
    "another program has it open; end that one (kilogui, a terminal program, a second swarmtalkd)";

OpenProblem problem_of(int error) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
    case EIO:
      return {OpenProblem::Kind::kAbsent,
              std::string(std::strerror(error)) + "; is it plugged in?"};
    case EBUSY:
      return {OpenProblem::Kind::kBusy, kInUse};
    case EACCES:
    case EPERM:
      return {OpenProblem::Kind::kWrong,
              "no permission; the user of swarmtalkd must be in the device's group (dialout): "
              "docs/kilobot.md"};
    default:
      return {OpenProblem::Kind::kWrong, std::strerror(error)};
  }
}

// Raw: no echo, no translation (a binary uplink has CR and NUL), modem lines ignored, and closing
// does not drop DTR, which would reset an Arduino.
void make_raw(termios2& settings, unsigned baud) {
  settings.c_iflag = 0;
  settings.c_oflag = 0;
  settings.c_lflag = 0;
  settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER | (BOTHER << IBSHIFT);
  settings.c_ispeed = settings.c_ospeed = baud;
  settings.c_cc[VMIN] = 1;  // with 0, "nothing waits" and "hung up" look the same
  settings.c_cc[VTIME] = 0;
}

}  // namespace

OpenProblem SerialDevice::open(const std::string& path, unsigned baud) {
  close();
  descriptor_ = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor_ < 0) return problem_of(errno);
  const auto refuse = [this](OpenProblem problem) {
    ::close(std::exchange(descriptor_, -1));
    return problem;
  };
  struct stat status {};
  termios2 settings{};
  if (::fstat(descriptor_, &status) != 0 || !S_ISCHR(status.st_mode) ||
      ::ioctl(descriptor_, TCGETS2, &settings) != 0) {
    const int error = errno;
    if (S_ISCHR(status.st_mode) && (error == EIO || error == ENXIO))
      return refuse(problem_of(error));
    return refuse({OpenProblem::Kind::kWrong,
                   "it is not a serial device; name one, preferably by /dev/serial/by-id/"});
  }
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    return refuse({OpenProblem::Kind::kBusy, kInUse});
  }
  if (::ioctl(descriptor_, TIOCEXCL) != 0) return refuse(problem_of(errno));
  make_raw(settings, baud);
  if (::ioctl(descriptor_, TCSETSF2, &settings) != 0) {
    const int error = errno;
    ::ioctl(descriptor_, TIOCNXCL);
    return refuse(problem_of(error));
  }
  ::ioctl(descriptor_, TCFLSH, TCIOFLUSH);
  return {};
}

void SerialDevice::close() {
  if (descriptor_ < 0) return;
  ::ioctl(descriptor_, TIOCNXCL);
  ::close(std::exchange(descriptor_, -1));
}

std::ptrdiff_t SerialDevice::write(std::span<const std::uint8_t> bytes) {
  for (;;) {
    const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
    if (count >= 0) return count;
    if (errno == EAGAIN) return 0;
    if (errno != EINTR) return -1;
  }
}

std::ptrdiff_t SerialDevice::read(std::span<std::uint8_t> bytes) {
  for (;;) {
    const ssize_t count = ::read(descriptor_, bytes.data(), bytes.size());
    if (count > 0) return count;
    if (count == 0) errno = EIO;  // hung up
    if (count < 0 && errno == EAGAIN) return 0;
    if (count == 0 || errno != EINTR) return -1;
  }
}

bool SerialDevice::is_drained() const {
  int waiting = 0;
  if (::ioctl(descriptor_, TIOCOUTQ, &waiting) == 0 && waiting > 0) return false;
  unsigned int line_status = TIOCSER_TEMT;
  if (::ioctl(descriptor_, TIOCSERGETLSR, &line_status) != 0) return true;  // it cannot tell
  return (line_status & TIOCSER_TEMT) != 0;
}

void SerialDevice::discard_output() {
  if (descriptor_ >= 0) ::ioctl(descriptor_, TCFLSH, TCOFLUSH);
}

}  // namespace swarmtalk::kilobot_bridge
