#include "cli/text/hex.hpp"

#include "text/plain.hpp"
#include "text/utf8.hpp"

namespace swarmtalk::cli {

std::optional<std::string> escaped(std::string_view bytes) {
  if (!text::is_utf8(bytes)) return std::nullopt;
  return text::escaped(bytes);
}

}  // namespace swarmtalk::cli
