#include "daemon/config/key_file.hpp"

#include <fcntl.h>
#include <pwd.h>
#include <sodium/utils.h>
#include <spdlog/fmt/fmt.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "daemon/config/file_access.hpp"
#include "text/encoding.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kMaxKeyFileBytes = 256;
constexpr std::size_t kKeyDigits = 2 * frame::SwarmKey::kBytes;

class Descriptor {
 public:
  explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

std::string user_name(uid_t uid) {
  const passwd* const user = getpwuid(uid);
  return user == nullptr ? std::to_string(uid) : user->pw_name;
}

void check_owner_and_mode(const std::string& path, const struct stat& status) {
  if (!S_ISREG(status.st_mode)) {
    throw std::runtime_error(path +
                             " is not a file; give the path of one, which `swarmtalk-cli keygen "
                             "FILE` makes");
  }
  if (status.st_uid != 0 && status.st_uid != geteuid()) {
    throw std::runtime_error(
        path + " belongs to " + user_name(status.st_uid) +
        ", who could change the key; run: " + own_key_command(path, status.st_uid));
  }
  if ((status.st_mode & 077) != 0) {
    throw std::runtime_error(fmt::format("{} has mode {:04o}, so others can reach the key; run: {}",
                                         path, status.st_mode & 07777u,
                                         own_key_command(path, status.st_uid)));
  }
}

std::shared_ptr<const frame::SwarmKey> parse_key(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  text = text::without_mark(text);
  const std::size_t begin = std::min(text.find_first_not_of(kBlanks), text.size());
  text.remove_prefix(begin);
  while (!text.empty() && kBlanks.find(text.back()) != std::string_view::npos) {
    text.remove_suffix(1);
  }
  if (text.size() != kKeyDigits) return nullptr;
  std::array<std::uint8_t, frame::SwarmKey::kBytes> bytes;
  if (sodium_hex2bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, nullptr,
                     nullptr) != 0) {
    return nullptr;
  }
  auto key = std::make_shared<const frame::SwarmKey>(
      std::span<const std::uint8_t, frame::SwarmKey::kBytes>(bytes));
  explicit_bzero(bytes.data(), bytes.size());
  return key;
}

// A file of zeros is what somebody writes to try it out, and forgets.
bool is_secret(const frame::SwarmKey& key) {
  const auto* const begin = key.bytes();
  return std::any_of(begin, begin + frame::SwarmKey::kBytes,
                     [&](std::uint8_t byte) { return byte != *begin; });
}

}  // namespace

std::shared_ptr<const frame::SwarmKey> load_key(const std::string& path) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (file.get() < 0) {
    throw std::runtime_error(path + " " + unreadable(path, errno, FileKind::kKey));
  }
  struct stat status {};
  if (fstat(file.get(), &status) != 0) throw std::runtime_error(path + ": " + std::strerror(errno));
  check_owner_and_mode(path, status);
  std::array<char, kMaxKeyFileBytes> text;
  const ssize_t got = read(file.get(), text.data(), text.size());
  const std::string_view read_text(text.data(),
                                   static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  const std::string encoding = text::encoding_problem(read_text);
  auto key = parse_key(read_text);
  explicit_bzero(text.data(), text.size());
  if (key != nullptr && is_secret(*key)) return key;
  if (key != nullptr) {
    throw std::runtime_error(path +
                             " holds one byte 32 times, which is not a secret; make a key with "
                             "`swarmtalk-cli keygen FILE`");
  }
  if (!encoding.empty()) throw std::runtime_error(path + " " + encoding);
  throw std::runtime_error(path +
                           " holds no key (64 hexadecimal digits and nothing else); copy the file "
                           "of another robot, or make a key for all with `swarmtalk-cli keygen "
                           "FILE`");
}

}  // namespace swarmtalk::daemon
