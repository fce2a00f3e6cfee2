#include "usage/terminal.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <sstream>

namespace swarmtalk::usage {
namespace {

constexpr std::size_t kFewestColumns = 20;
constexpr std::size_t kNarrowIndent = 4;

bool is_set(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0';
}

/// Where the further lines of a long one begin: below the description in its second column.
std::size_t indent_of(const std::string& line) {
  const std::size_t first = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t gap = first == 0 ? std::string::npos : line.find("  ", first);
  if (gap == std::string::npos) return first;
  return std::min(line.find_first_not_of(' ', gap), line.size());
}

void wrap(const std::string& line, std::size_t columns, std::string& text) {
  std::size_t indent = indent_of(line);
  if (indent + 15 > columns) indent = kNarrowIndent;
  std::string rest = line;
  while (rest.size() > columns) {
    const std::size_t begin = std::max(rest.find_first_not_of(' '), indent);
    std::size_t cut = rest.rfind(' ', columns);
    if (cut == std::string::npos || cut <= begin) {
      if (const std::size_t comma = rest.rfind(',', columns - 1);
          comma != std::string::npos && comma > begin) {  // a list without blanks
        text += rest.substr(0, comma + 1) + "\n";
        rest = std::string(indent, ' ') + rest.substr(comma + 1);
        continue;
      }
      cut = rest.find(' ', columns);
    }
    if (cut == std::string::npos) break;  // one long word
    const std::size_t next = rest.find_first_not_of(' ', cut);
    text += rest.substr(0, rest.find_last_not_of(' ', cut) + 1) + "\n";
    if (next == std::string::npos) return;
    rest = std::string(indent, ' ') + rest.substr(next);
  }
  text += rest + "\n";
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

std::string wrapped(const std::string& text, std::size_t columns) {
  std::string result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.size() > columns) {
      wrap(line, columns, result);
    } else {
      result += line + "\n";
    }
  }
  return result;
}

std::string folded(const std::string& text, int fd) {
  const std::size_t told = columns(fd);
  return told == 0 ? text : wrapped(text, told);
}

}  // namespace swarmtalk::usage
