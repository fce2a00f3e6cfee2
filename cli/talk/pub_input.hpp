// PubInput: where `pub` has its messages from: the command line, a file or standard input, as one
// message or a message a line; as they are, in hexadecimal, or as values of a struct.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "cli/common/commands.hpp"
#include "cli/text/struct_format.hpp"

namespace swarmtalk::cli {

class PubInput {
 public:
  static constexpr std::size_t kMaxBytes = 256 * 1024;  // longer than any message, also in hex

  enum class State { kMessage, kWait, kEnd, kBad };

  PubInput() = default;
  PubInput(const PubInput&) = delete;
  PubInput& operator=(const PubInput&) = delete;
  ~PubInput();

  /// Without lines: reads all of it. @return empty, or what is wrong: see exit_code()
  std::string open(const PubArguments& arguments);
  int exit_code() const { return exit_code_; }

  /// Without lines: the one message. Longer than kMaxBytes: cut there, and is_cut() says so.
  const std::string& payload() const { return payload_; }
  bool is_cut() const { return is_cut_; }

  /// With lines: the next one, as a message, if it is there. A carriage return before the line feed
  /// and a mark before the first line are no part of it. An empty line is an empty message, but not
  /// in hexadecimal.
  /// @return kWait: read() when fd() is readable; kBad: problem() says which line
  State next_line(std::string& payload);
  int fd() const { return fd_; }
  void read();
  const std::string& problem() const { return problem_; }

  /// That the line last taken was not sent, why, and how many before it were.
  std::string not_sent(std::string_view why) const;

 private:
  std::string convert(std::string& payload) const;

  bool is_hex_ = false;
  std::optional<StructFormat> format_;
  std::string name_;
  std::string payload_;
  std::string problem_;
  int exit_code_ = kExitFailure;
  bool is_cut_ = false;
  int fd_ = -1;
  bool owns_fd_ = false;
  bool is_at_end_ = false;
  std::string waiting_;
  std::uint64_t line_ = 0;
};

}  // namespace swarmtalk::cli
