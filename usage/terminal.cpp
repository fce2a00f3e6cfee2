#include "usage/terminal.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace swarmtalk::usage {
namespace {

constexpr std::size_t kFewestColumns = 20;

bool is_set(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0';
}

}  // namespace

std::size_t columns(int fd) {
  if (::isatty(fd) == 0) return 0;
  winsize size{};
  if (::ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
    return std::max<std::size_t>(size.ws_col, kFewestColumns);
  }
  const long told = is_set("COLUMNS") ? std::atol(std::getenv("COLUMNS")) : 0;
  return told > 0 ? std::max(static_cast<std::size_t>(told), kFewestColumns) : 0;
}

bool has_colour(int fd) {
  if (::isatty(fd) == 0 || is_set("NO_COLOR")) return false;
  return is_set("TERM") && std::strcmp(std::getenv("TERM"), "dumb") != 0;
}

}  // namespace swarmtalk::usage
