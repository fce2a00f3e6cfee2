#include "cli/talk/pub_input.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "cli/text/hex.hpp"
#include "text/counted.hpp"
#include "text/encoding.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::string_view kBetweenWords = " \t\r\n,";

/// By a mark: without one such text may be any bytes.
bool is_marked_wide(std::string_view line) {
  constexpr std::string_view kUtf32BigEnd("\0\0\xFE\xFF", 4);
  return line.starts_with("\xFF\xFE") || line.starts_with("\xFE\xFF") ||
         line.starts_with(kUtf32BigEnd);
}

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  for (;;) {
    const auto begin = text.find_first_not_of(kBetweenWords);
    if (begin == std::string_view::npos) return words;
    text.remove_prefix(begin);
    const auto size = std::min(text.find_first_of(kBetweenWords), text.size());
    words.emplace_back(text.substr(0, size));
    text.remove_prefix(size);
  }
}

}  // namespace

PubInput::~PubInput() {
  if (owns_fd_) ::close(fd_);
}

std::string PubInput::open(const PubArguments& arguments) {
  is_hex_ = arguments.is_hex;
  if (!arguments.struct_format.empty()) {
    format_ = StructFormat::parse(arguments.struct_format, problem_);
    exit_code_ = kExitUsage;
    if (!format_) return "--fmt " + arguments.struct_format + " is not a format: " + problem_;
    if (is_hex_) return "--fmt and --hex cannot go together: one of them says what DATA is";
  }
  name_ = "standard input";
  fd_ = STDIN_FILENO;
  exit_code_ = kExitFailure;
  if (!arguments.file.empty()) {
    name_ = arguments.file;
    fd_ = ::open(arguments.file.c_str(), O_RDONLY | O_CLOEXEC);
    owns_fd_ = fd_ >= 0;
    if (fd_ < 0) return "cannot read " + name_ + ": " + std::strerror(errno);
  } else if (!arguments.is_lines && arguments.payload != "-") {
    payload_ = arguments.payload;
    is_at_end_ = true;
  }
  if (arguments.is_lines) return {};
  while (!is_at_end_ && waiting_.size() <= kMaxBytes) read();
  if (!problem_.empty()) return problem_;
  payload_ += waiting_;
  is_cut_ = payload_.size() > kMaxBytes;
  exit_code_ = kExitUsage;
  return is_cut_ ? std::string() : convert(payload_);
}

void PubInput::read() {
  char buffer[4096];
  const ssize_t count = ::read(fd_, buffer, sizeof buffer);
  if (count > 0) waiting_.append(buffer, static_cast<std::size_t>(count));
  if (count == 0) is_at_end_ = true;
  if (count < 0 && (errno != EINTR || caught_signal() != 0)) {
    is_at_end_ = true;
    if (errno != EINTR) problem_ = "cannot read " + name_ + ": " + std::strerror(errno);
  }
}

PubInput::State PubInput::next_line(std::string& payload) {
  const auto end = waiting_.find('\n');
  if (end == std::string::npos && !is_at_end_ && waiting_.size() <= kMaxBytes) return State::kWait;
  if (end == std::string::npos && waiting_.empty()) {
    return problem_.empty() ? State::kEnd : State::kBad;
  }
  ++line_;
  std::string_view line = std::string_view(waiting_).substr(0, end);
  if (end != std::string::npos) line = text::without_return(line);
  std::string why;
  const bool is_text = is_hex_ || format_.has_value();
  if (line_ == 1 && is_marked_wide(line)) why = "it " + text::encoding_problem(line);
  if (line_ == 1 || is_text) line = text::without_mark(line);
  if (why.empty() && is_text && !text::bare_return_problem(line).empty()) {
    why = "it " + text::bare_return_problem(line);
  }
  payload = line;
  waiting_.erase(0, end == std::string::npos ? end : end + 1);
  if (why.empty() && payload.size() > kMaxBytes) why = "it is too long for any channel";
  if (why.empty() && is_hex_ && words_of(payload).empty()) {
    why = "it is blank, and --hex takes pairs of digits; remove it";
  }
  if (why.empty()) why = convert(payload);
  if (why.empty()) return State::kMessage;
  problem_ = not_sent(why);
  return State::kBad;
}

std::string PubInput::not_sent(std::string_view why) const {
  const std::string before =
      line_ == 1 ? "nothing has"
                 : text::counted(line_ - 1, "line before it has", "lines before it have");
  return "line " + std::to_string(line_) + " of " + name_ + " was not sent: " + std::string(why) +
         "; " + before + " been sent";
}

std::string PubInput::convert(std::string& payload) const {
  if (!is_hex_ && !format_) return {};
  if (const std::string problem = text::encoding_problem(payload); !problem.empty()) {
    return "DATA " + problem;
  }
  payload = text::without_mark(payload);
  if (is_hex_) {
    const auto bytes = from_hex(payload);
    if (!bytes) return "DATA is not hexadecimal: pairs of digits, as in 48:65:6c";
    payload = *bytes;
  }
  if (format_) {
    std::string why;
    const auto bytes = format_->pack(words_of(payload), why);
    if (!bytes) return why;
    payload = *bytes;
  }
  return {};
}

}  // namespace swarmtalk::cli
