#include "text/toml_text.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "text/encoding.hpp"
#include "text/plain.hpp"
#include "text/utf8.hpp"

namespace swarmtalk::text {
namespace {

constexpr const char* kControl =
    "a control character; remove it (in double quotes write \\u and its four hexadecimal digits)";
constexpr const char* kBareReturn =
    "a carriage return without a line feed; save the file with line ends of Unix or Windows";
constexpr const char* kTooDeep = "a key of more than 256 parts; use fewer dots";
constexpr std::size_t kMostDots = 255;  // of a key: each is a level of recursion
constexpr const char* kNotUtf8 = "bytes that are not UTF-8; save the file as UTF-8";
constexpr const char* kNoEscape = "a backslash that begins no escape; write two of them for one";
constexpr std::string_view kEscapes = "\"\\bfnrtuU";

/// Instead of a character outside quotes that is not ASCII. Those are left from word processors and
/// web pages.
const char* remedy_for(std::uint32_t code_point) {
  const bool is_quote = (code_point >= 0x2018 && code_point <= 0x201F) || code_point == 0xAB ||
                        code_point == 0xBB || (code_point >= 0x2032 && code_point <= 0x2036);
  const bool is_blank = code_point == 0xA0 || (code_point >= 0x2000 && code_point <= 0x200A) ||
                        code_point == 0x202F || code_point == 0x3000;
  return is_quote   ? "type a plain quote (\") instead"
         : is_blank ? "type a plain blank instead"
                    : "remove it, or put the whole name or text in double quotes";
}

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (byte < 0x20 && c != '\t' && c != '\n' && c != '\r') || byte == 0x7F;
}

bool is_ascii(char c) {
  return static_cast<unsigned char>(c) < 0x80;
}

std::string formatted(const char* format, std::uint32_t code_point) {
  std::array<char, 16> text;
  std::snprintf(text.data(), text.size(), format, code_point);
  return text.data();
}

bool begins_character(char c) {
  return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
}

class Converter {
 public:
  explicit Converter(std::string_view text) : text_(without_mark(text)) {}

  AsciiToml convert() {
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
      } else {
        refuse_character();
      }
    }
    return std::move(result_);
  }

 private:
  bool is_next(std::string_view expected) const {
    return text_.substr(at_, expected.size()) == expected;
  }

  bool is_bare_return() const { return text_[at_] == '\r' && text_.substr(at_ + 1, 1) != "\n"; }

  void fail(const std::string& what) { fail_at(at_, what); }

  void fail_at(std::size_t at, const std::string& what) {
    const std::string_view before = text_.substr(0, at);
    result_.line = 1 + static_cast<unsigned>(std::count(before.begin(), before.end(), '\n'));
    const auto in_line = before.substr(before.find_last_of('\n') + 1);
    const auto column = 1 + std::count_if(in_line.begin(), in_line.end(), begins_character);
    result_.what = "column " + std::to_string(column) + ": " + what;
  }

  void refuse_character() {
    std::size_t next = at_;
    const std::optional<std::uint32_t> code_point = text::next_code_point(text_, next);
    if (!code_point) return fail(kNotUtf8);
    fail("the character " + formatted("U+%04X", *code_point) + " stands outside quotes; " +
         remedy_for(*code_point));
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
    result_.text += formatted("\\U%08X", *code_point);
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

  /// A backslash and what it stands before; between three quotes that may be the end of the line.
  void take_escape(bool is_long) {
    const char next = at_ + 1 < text_.size() ? text_[at_ + 1] : '\n';
    const bool is_end = next == '\n' || next == '\r';
    const bool is_blank = is_end || (is_long && (next == ' ' || next == '\t'));
    if (!is_blank && kEscapes.find(next) == std::string_view::npos) return fail(kNoEscape);
    take();
    if (!is_end) take();
  }

  void take_string() {
    const std::size_t begin = at_;
    const char quote = text_[at_];
    const bool has_escapes = quote == '"';
    const std::string three(3, quote);
    const std::size_t size = is_next(three) ? 3 : 1;
    skip_quotes(size);
    result_.text.append(size, '"');
    const std::string_view mark = std::string_view(three).substr(0, size);
    while (at_ < text_.size() && result_.line == 0 && !is_next(mark)) {
      if (size == 1 && text_[at_] == '\n') break;
      if (has_escapes && text_[at_] == '\\') {
        take_escape(size == 3);
      } else {
        take_in_string(has_escapes);
      }
    }
    if (result_.line != 0) return;
    if (!is_next(mark)) {
      const std::string shown(mark);
      return fail_at(begin, "a text begins here with " + shown + " and has no second " + shown +
                                (size == 1 ? " in its line" : "") + "; add it at its end");
    }
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

// What toml++ says that it parsed when text has no quotes.
constexpr const char* kScopesOfValues[] = {"value", "boolean", "floating", "hexadecimal", "decimal",
                                           "octal", "binary",  "date",     "time"};

constexpr std::size_t kMostOfItsWords = 160;  // bytes

/// toml++ looks at the names of a header at times when it has read the end of its line: then the
/// lines before the one that it tells are wrong already.
unsigned line_of(const toml::parse_error& error, std::string_view text) {
  const unsigned line = error.source().begin.line;
  if (!error.description().starts_with("Error while parsing table header")) return line;
  std::size_t begin = 0;
  for (unsigned i = 1; i < line; ++i) begin = text.find('\n', begin) + 1;
  try {
    static_cast<void>(toml::parse(text.substr(0, begin)));
  } catch (const toml::parse_error&) {
    return line - 1;
  }
  return line;
}

/// What is wrong in the words of toml++, with a remedy; in ours where its own are garbled.
std::string what_of(const toml::parse_error& error) {
  const std::string_view what = error.description();
  for (const char* twice : {"cannot redefine", "cannot insert"}) {
    if (what.find(twice) == std::string_view::npos) continue;
    return "the key or section of this line is there twice; keep one of the two";
  }
  constexpr std::string_view kStart = "Error while parsing ";
  const std::string_view scope = what.substr(std::min(kStart.size(), what.size()));
  const bool is_value = std::any_of(std::begin(kScopesOfValues), std::end(kScopesOfValues),
                                    [&](const char* each) { return scope.starts_with(each); });
  return plain(what.substr(0, std::min(kMostOfItsWords, what.find('\n')))) +
         (is_value ? "; if it is text, put it in double quotes"
                   : "; see https://toml.io for the format");
}

}  // namespace

AsciiToml to_ascii(std::string_view text) {
  return Converter(text).convert();
}

toml::table parse_toml(std::string_view text, const std::string& file) {
  if (const std::string problem = encoding_problem(text); !problem.empty()) {
    throw std::runtime_error(file + ": " + problem);
  }
  const AsciiToml ascii = to_ascii(text);
  const auto error_at = [&](unsigned line, const std::string& what) {
    return std::runtime_error(file + ":" + std::to_string(line) + ": not TOML: " + what);
  };
  if (ascii.line != 0) throw error_at(ascii.line, ascii.what);
  try {
    return toml::parse(ascii.text, file);
  } catch (const toml::parse_error& error) {
    throw error_at(line_of(error, ascii.text), what_of(error));
  } catch (const std::logic_error&) {  // an assertion of the parser
    throw std::runtime_error(file + ": not TOML; see https://toml.io for the format");
  }
}

toml::table parse_toml_file(const std::string& path) {
  std::error_code error;
  std::string text;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw std::runtime_error(path + ": " + error.message());
  text.resize(size);
  std::ifstream file(path, std::ios::binary);
  if (!file.read(text.data(), static_cast<std::streamsize>(size))) {
    throw std::runtime_error(path + ": " + std::strerror(errno));
  }
  return parse_toml(text, path);
}

}  // namespace swarmtalk::text
