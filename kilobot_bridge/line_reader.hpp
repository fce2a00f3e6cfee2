// LineReader: lines of text from a robot that prints to its serial line, with any firmware. Lines
// end at LF; CR is left out; what is longer than kMostBytes is cut there; bytes that are no UTF-8
// become U+FFFD, so that a line can be published and shown as it is.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

namespace swarmtalk::kilobot_bridge {

class LineReader {
 public:
  static constexpr std::size_t kMostBytes = 256;

  struct Counters {
    std::uint64_t lines = 0;
    std::uint64_t cut_lines = 0;
    std::uint64_t bytes = 0;
  };

  /// @param on_line  called with each line that is not empty, valid UTF-8
  explicit LineReader(std::function<void(const std::string&)> on_line)
      : on_line_(std::move(on_line)) {}

  void put(std::span<const std::uint8_t> bytes);
  /// The line was interrupted: what has come of a line is thrown away.
  void on_interrupted();

  const Counters& counters() const { return counters_; }

 private:
  void end_line();

  std::function<void(const std::string&)> on_line_;
  std::string line_;
  bool is_cut_ = false;
  Counters counters_;
};

/// `bytes` with whatever is no UTF-8 replaced by U+FFFD.
std::string to_utf8(const std::string& bytes);

}  // namespace swarmtalk::kilobot_bridge
