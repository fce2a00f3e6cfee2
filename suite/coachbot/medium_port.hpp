// MediumPort: how the bodies of a lab's robots tell a radio medium where they are (docs/radio.md),
// so that who hears whom follows them. In a lab whose medium has no places it does nothing.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace swarmtalk::suite {

class MediumPort {
 public:
  /// To the socket that $SWARMTALK_MEDIUM names.
  /// @throws std::runtime_error  nobody listens there
  MediumPort() {
    const char* path = std::getenv("SWARMTALK_MEDIUM");
    if (path == nullptr || *path == 0) return;
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::string(path).copy(address.sun_path, sizeof address.sun_path - 1);
    fd_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    if (fd_ < 0 || connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error(std::string("the lab's medium does not listen at ") + path);
    }
  }
  ~MediumPort() {
    if (fd_ >= 0) close(fd_);
  }
  MediumPort(const MediumPort&) = delete;
  MediumPort& operator=(const MediumPort&) = delete;

  /// Robot `index` (from 0) is there now. Never waits; what is not taken is followed by newer.
  void put(uint32_t index, double x_mm, double y_mm) {
    if (fd_ < 0) return;
    std::array<char, 128> text{};
    const int size =
        std::snprintf(text.data(), text.size(), R"({"do":"move","robot":%u,"x_m":%.4f,"y_m":%.4f})",
                      index + 1, x_mm / 1000, y_mm / 1000);
    refused_ += send(fd_, text.data(), static_cast<size_t>(size), MSG_DONTWAIT | MSG_NOSIGNAL) < 0;
    // An answer is {} or says why not.
    for (ssize_t n = 0; (n = recv(fd_, text.data(), text.size(), MSG_DONTWAIT)) > 0;) {
      refused_ += n > 2;
    }
  }

  uint32_t refused() const { return refused_; }

 private:
  int fd_ = -1;
  uint32_t refused_ = 0;  // places that the medium did not take
};

}  // namespace swarmtalk::suite
