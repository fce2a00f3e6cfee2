// KeyFile: a swarm key for `key_file`, in memory: nothing of it is left if the test is killed.
#pragma once

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <string>
#include <system_error>

namespace swarmtalk::test {

class KeyFile {
 public:
  /// @param number  of the key: each has another
  explicit KeyFile(std::uint32_t number = 1) : descriptor_(::memfd_create("key", MFD_CLOEXEC)) {
    std::string key;
    std::uint32_t bits = number;
    for (int i = 0; i < 64; ++i) {
      bits = bits * 1664525 + 1013904223;
      key += "0123456789abcdef"[bits >> 28];
    }
    if (descriptor_ < 0 || ::fchmod(descriptor_, 0600) != 0 ||
        ::write(descriptor_, key.data(), key.size()) < 0) {
      throw std::system_error(errno, std::system_category(), "the file of a swarm key");
    }
  }
  ~KeyFile() { ::close(descriptor_); }
  KeyFile(const KeyFile&) = delete;
  KeyFile& operator=(const KeyFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

}  // namespace swarmtalk::test
