#include <fcntl.h>
#include <sys/random.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "cli/common/commands.hpp"
#include "cli/text/hex.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::size_t kKeyBytes = 32;  // docs/wire-format.md

}  // namespace

int keygen(const std::string& path) {
  std::array<char, kKeyBytes> bytes;
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    return fail("the kernel gives no random numbers (getrandom)");
  }
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (file < 0) {
    const std::string remedy =
        errno == EEXIST ? "; a key is never written over: remove it, or choose another name" : "";
    return fail("cannot make " + path + ": " + std::strerror(errno) + remedy);
  }
  const std::string text = to_hex({bytes.data(), bytes.size()}) + "\n";
  const bool is_written =
      write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
      fsync(file) == 0;
  if (close(file) != 0 || !is_written) {
    const std::string why = std::strerror(errno);
    unlink(path.c_str());
    return fail("cannot write " + path + ": " + why);
  }
  return print(path +
               ": a new swarm key. Copy it to every robot, and there: sudo install -D -o swarmtalk "
               "-m 0400 " +
               std::filesystem::path(path).filename().string() +
               " /etc/swarmtalk/swarm.key; set key_file under [links.NAME] to that; restart "
               "swarmtalkd.\n");
}

}  // namespace swarmtalk::cli
