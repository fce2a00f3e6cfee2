#include "daemon/printable.hpp"

#include <algorithm>

#include "daemon/config.hpp"

namespace swarmtalk::daemon {
namespace {

bool is_control(char c) {
  return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
}

}  // namespace

std::string printable(std::string_view text, std::size_t most_bytes) {
  std::string line(text.substr(0, most_bytes));
  std::replace_if(line.begin(), line.end(), is_control, '?');
  return text.size() > most_bytes ? line + "..." : line;
}

bool is_legal_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxNameBytes &&
         std::none_of(name.begin(), name.end(), is_control);
}

}  // namespace swarmtalk::daemon
