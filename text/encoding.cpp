#include "text/encoding.hpp"

using std::string_view_literals::operator""sv;

namespace swarmtalk::text {
namespace {

constexpr std::string_view kMark = "\xEF\xBB\xBF";

/// "10" is a Latin letter in UTF-16, little end first: 0 stands for a byte that is zero.
bool has_zeros_as(std::string_view text, std::string_view pattern) {
  if (text.size() < pattern.size()) return false;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if ((text[i] == '\0') != (pattern[i] == '0')) return false;
  }
  return true;
}

}  // namespace

std::string encoding_problem(std::string_view text) {
  const bool has_mark = text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF");
  const bool is_wide = has_zeros_as(text, "1000") || has_zeros_as(text, "0001") ||
                       text.starts_with("\xFF\xFE\0\0"sv) || text.starts_with("\0\0\xFE\xFF"sv);
  if (is_wide) return "is UTF-32; save it as UTF-8";
  const bool is_double = has_mark || has_zeros_as(text, "1010") || has_zeros_as(text, "0101");
  return is_double ? "is UTF-16; save it as UTF-8" : "";
}

std::string_view without_mark(std::string_view text) {
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
  return text;
}

std::string_view without_return(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::string bare_return_problem(std::string_view line) {
  if (line.find('\r') == std::string_view::npos) return {};
  return "has a carriage return without a line feed; save it with line ends of Unix or Windows";
}

}  // namespace swarmtalk::text
