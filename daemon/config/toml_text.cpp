#include "daemon/config/toml_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>

#include "text/utf8.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kStartBytes = 8;  // UTF-16 and UTF-32, as Windows writes it, has zeros there
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr const char* kControl =
    "a control character; remove it (in double quotes write \\u and its four hexadecimal digits)";
constexpr const char* kBareReturn =
    "a carriage return without a line feed; save the file with line ends of Unix or Windows";
constexpr const char* kTooDeep = "a key of more than 256 parts; use fewer dots";
constexpr std::size_t kMostDots = 255;  // of a key: each is a level of recursion
constexpr const char* kNotUtf8 = "bytes that are not UTF-8; save the file as UTF-8";

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (byte < 0x20 && c != '\t' && c != '\n' && c != '\r') || byte == 0x7F;
}

bool is_ascii(char c) {
  return static_cast<unsigned char>(c) < 0x80;
}

class Converter {
 public:
  explicit Converter(std::string_view text) : text_(text) {}

  AsciiToml convert() {
    if (text_.find('\0') < kStartBytes || is_next("\xFF\xFE") || is_next("\xFE\xFF")) {
      fail(kNotUtf8);
      return std::move(result_);
    }
    if (text_.substr(0, kByteOrderMark.size()) == kByteOrderMark) at_ = kByteOrderMark.size();
    while (at_ < text_.size() && result_.line == 0) {
      const char c = text_[at_];
      if (c == '"' || c == '\'') {
        take_string();
      } else if (c == '#') {
        skip_comment();
      } else if (is_ascii(c)) {
        dots_ = c == '.' ? dots_ + 1 : c == '\n' || c == '=' || c == ',' ? 0 : dots_;
        if (dots_ > kMostDots) {
          fail(kTooDeep);
        } else {
          take();
        }
      } else if (std::size_t next = at_; !text::next_code_point(text_, next)) {
        fail(kNotUtf8);
      } else {
        fail(
            "a character that is not ASCII stands outside quotes (a curly quote?); replace it, or "
            "put \"...\" around it");
      }
    }
    return std::move(result_);
  }

 private:
  bool is_next(std::string_view expected) const {
    return text_.substr(at_, expected.size()) == expected;
  }

  bool is_bare_return() const { return text_[at_] == '\r' && text_.substr(at_ + 1, 1) != "\n"; }

  void fail(const char* what) {
    const auto end = text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size()));
    result_.line = 1 + static_cast<unsigned>(std::count(text_.begin(), end, '\n'));
    result_.what = what;
  }

  /// One ASCII character.
  void take() {
    if (is_control(text_[at_])) return fail(kControl);
    if (is_bare_return()) return fail(kBareReturn);
    result_.text += text_[at_++];
  }

  /// One character of a string; one of a string in single quotes as double quotes have it.
  void take_in_string(bool has_escapes) {
    const char c = text_[at_];
    if (is_ascii(c)) {
      if (!has_escapes && (c == '\\' || c == '"')) result_.text += '\\';
      return take();
    }
    const std::optional<std::uint32_t> code_point = text::next_code_point(text_, at_);
    if (!code_point) return fail(kNotUtf8);
    result_.text += fmt::format("\\U{:08X}", *code_point);
  }

  void skip_comment() {
    while (at_ < text_.size() && text_[at_] != '\n') {
      if (is_control(text_[at_])) return fail(kControl);
      if (is_bare_return()) return fail(kBareReturn);
      if (!text::next_code_point(text_, at_)) return fail(kNotUtf8);
    }
  }

  /// The next character and what follows of the same, at most so many.
  std::size_t skip_quotes(std::size_t most) {
    const std::size_t begin = at_;
    const char quote = text_[at_];
    while (at_ < text_.size() && at_ < begin + most && text_[at_] == quote) ++at_;
    return at_ - begin;
  }

  /// What is not closed, the parser will refuse.
  void take_string() {
    const char quote = text_[at_];
    const bool has_escapes = quote == '"';
    const std::string three(3, quote);
    const std::size_t size = is_next(three) ? 3 : 1;
    skip_quotes(size);
    result_.text.append(size, '"');
    const std::string_view mark = std::string_view(three).substr(0, size);
    while (at_ < text_.size() && result_.line == 0 && !is_next(mark)) {
      if (size == 1 && text_[at_] == '\n') return;
      const bool is_escape = has_escapes && text_[at_] == '\\';
      take_in_string(has_escapes);
      if (!is_escape || at_ == text_.size()) continue;
      if (!is_ascii(text_[at_])) {
        return fail("a backslash stands before a character that is not ASCII; remove it");
      }
      take();
    }
    if (result_.line != 0 || at_ == text_.size()) return;
    const std::size_t own = skip_quotes(size == 3 ? 5 : 1) - size;  // two may belong to the text
    for (std::size_t i = 0; i < own; ++i) result_.text += has_escapes ? "\\\"" : "'";
    result_.text.append(size, '"');
    if (at_ < text_.size() && (text_[at_] == '"' || text_[at_] == '\'')) result_.text += ' ';
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t dots_ = 0;  // of this key, or number
  AsciiToml result_;
};

}  // namespace

AsciiToml to_ascii(std::string_view text) {
  return Converter(text).convert();
}

}  // namespace swarmtalk::daemon
