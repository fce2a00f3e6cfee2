#include "daemon/config/toml_text.hpp"

#include <algorithm>

namespace swarmtalk::daemon {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (byte < 0x20 && c != '\t' && c != '\n' && c != '\r') || byte == 0x7F;
}

// First position after the string that begins at `at`; the end when it is not closed.
std::size_t skip_quoted(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const bool has_escapes = quote == '"';
  const bool is_multiline = text.substr(at, 3) == std::string_view(quote == '"' ? "\"\"\"" : "'''");
  const std::string_view closing = text.substr(at, is_multiline ? 3 : 1);
  at += closing.size();
  while (at < text.size()) {
    if (text.substr(at, closing.size()) == closing) return at + closing.size();
    if (!is_multiline && text[at] == '\n') return at;  // not closed: the parser will say so
    at += has_escapes && text[at] == '\\' ? 2 : 1;
  }
  return text.size();
}

}  // namespace

StrayCharacter find_stray_character(std::string_view text) {
  const auto line_of = [&](std::size_t at) {
    const auto lines =
        std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    return 1 + static_cast<unsigned>(lines);
  };
  const auto control = std::find_if(text.begin(), text.end(), is_control);
  if (control != text.end()) {
    return {line_of(static_cast<std::size_t>(control - text.begin())),
            "a control character; remove it (in a string write it as \\u0000)"};
  }
  std::size_t at = text.substr(0, 3) == kByteOrderMark ? 3 : 0;
  while (at < text.size()) {
    const char c = text[at];
    if (c == '"' || c == '\'') {
      at = skip_quoted(text, at);
    } else if (c == '#') {
      at = std::min(text.find('\n', at), text.size());
    } else if (static_cast<unsigned char>(c) >= 0x80) {
      return {
          line_of(at),
          "a character that is not ASCII stands outside quotes (a curly quote?); replace it, or "
          "put \"...\" around it"};
    } else {
      ++at;
    }
  }
  return {};
}

}  // namespace swarmtalk::daemon
