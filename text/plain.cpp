#include "text/plain.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "text/utf8.hpp"

namespace swarmtalk::text {
namespace {

struct Range {
  std::uint32_t first;
  std::uint32_t last;
};

// In order. Unicode 15: categories Cc, Zl, Zp, and those of Cf that have no width or a direction.
constexpr std::array<Range, 13> kNotPlain{{
    {0x00, 0x1F},        // C0
    {0x7F, 0x9F},        // DEL, C1
    {0xAD, 0xAD},        // soft hyphen
    {0x61C, 0x61C},      // Arabic letter mark
    {0x180E, 0x180E},    // Mongolian vowel separator
    {0x200B, 0x200F},    // zero width space and joiners, marks of direction
    {0x2028, 0x202E},    // separators of lines and paragraphs, embeddings, overrides
    {0x2060, 0x206F},    // word joiner, invisible operators, isolates
    {0xFE00, 0xFE0E},    // variation selectors; U+FE0F, which emoji have, is left
    {0xFEFF, 0xFEFF},    // byte order mark
    {0xFFF9, 0xFFFB},    // annotations
    {0x1D173, 0x1D17A},  // marks of musical notation
    {0xE0000, 0xE0FFF},  // tags, more variation selectors
}};

std::string escape(std::uint32_t code) {
  if (code == '\n') return "\\n";
  if (code == '\t') return "\\t";
  if (code == '\r') return "\\r";
  char text[16];
  if (code <= 0xFFFF) {
    std::snprintf(text, sizeof text, "\\u%04x", code);
  } else {  // two halves, as JSON has it
    const std::uint32_t rest = code - 0x10000;
    std::snprintf(text, sizeof text, "\\u%04x\\u%04x", 0xD800 + (rest >> 10),
                  0xDC00 + (rest & 0x3FF));
  }
  return text;
}

std::string escape_byte(char byte) {
  char text[8];
  std::snprintf(text, sizeof text, "\\x%02x", static_cast<unsigned char>(byte));
  return text;
}

/// @param kept   a control character that stays; 0: none
/// @param quote  gets a backslash in front, and so do backslashes; 0: none
std::string rewritten(std::string_view bytes, char kept, char quote) {
  std::string text;
  text.reserve(bytes.size());
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t begin = at;
    const auto code = next_code_point(bytes, at);
    if (!code) {
      text += escape_byte(bytes[at++]);
    } else if (is_plain(*code) || (kept != 0 && bytes[begin] == kept)) {
      if (quote != 0 && (bytes[begin] == quote || bytes[begin] == '\\')) text += '\\';
      text += bytes.substr(begin, at - begin);
    } else {
      text += escape(*code);
    }
  }
  return text;
}

bool is_of_a_word(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= 0x80 || (byte >= '0' && byte <= '9') || (byte >= 'A' && byte <= 'Z') ||
         (byte >= 'a' && byte <= 'z') || std::string_view("-_./:+@").find(c) != std::string::npos;
}

}  // namespace

bool is_plain(std::uint32_t code_point) {
  return std::none_of(kNotPlain.begin(), kNotPlain.end(), [code_point](const Range& range) {
    return range.first <= code_point && code_point <= range.last;
  });
}

bool is_plain_text(std::string_view bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const auto code = next_code_point(bytes, at);
    if (!code || !is_plain(*code)) return false;
  }
  return true;
}

std::string plain(std::string_view bytes) {
  return rewritten(bytes, 0, 0);
}

std::string escaped(std::string_view bytes) {
  return rewritten(bytes, 0, '\\');
}

std::string plain_lines(std::string_view bytes) {
  return rewritten(bytes, '\n', 0);
}

std::string quoted(std::string_view name, char quote) {
  return quote + rewritten(name, 0, quote) + quote;
}

std::string shown_name(std::string_view name) {
  const bool is_word =
      !name.empty() && is_plain_text(name) && std::all_of(name.begin(), name.end(), is_of_a_word);
  return is_word ? std::string(name) : quoted(name, '"');
}

std::string shell_word(std::string_view word) {
  if (!word.empty() && std::all_of(word.begin(), word.end(), is_of_a_word))
    return std::string(word);
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? "'\\''" : std::string(1, c);
  return text + "'";
}

}  // namespace swarmtalk::text
