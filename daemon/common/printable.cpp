#include "daemon/common/printable.hpp"

#include "text/plain.hpp"
#include "text/utf8.hpp"

namespace swarmtalk::daemon {

std::string printable(std::string_view text, std::size_t most_bytes) {
  std::string line;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t begin = at;
    const auto code = text::next_code_point(text, at);
    if (!code) ++at;
    const std::size_t taken = at - begin;
    if (line.size() + taken > most_bytes) return line + "...";
    if (code && text::is_plain(*code)) {
      line += text.substr(begin, taken);
    } else {
      line += '?';
    }
  }
  return line;
}

}  // namespace swarmtalk::daemon
