// PatientSink: log lines to stderr, but never a wait: a line is dropped and counted while nobody
// reads the pipe, terminal or journal behind it. Used by start_logging(), on the daemon's thread.
#pragma once

#include <spdlog/sinks/sink.h>

#include <cstdint>

namespace swarmtalk::daemon {

class PatientSink final : public spdlog::sinks::sink {
 public:
  /// A pipe that takes anything takes as much at once (PIPE_BUF), so no line is longer.
  static constexpr std::size_t kLongestLineBytes = 3500;

  /// @param inner  writes to `descriptor`
  PatientSink(spdlog::sink_ptr inner, int descriptor)
      : inner_(std::move(inner)), descriptor_(descriptor) {}

  void log(const spdlog::details::log_msg& message) override;
  void flush() override {}  // it holds nothing back
  void set_pattern(const std::string& pattern) override { inner_->set_pattern(pattern); }
  void set_formatter(std::unique_ptr<spdlog::formatter> formatter) override {
    inner_->set_formatter(std::move(formatter));
  }

  /// Lines dropped, of all that were ever made.
  static std::uint64_t lost() { return lost_; }

 private:
  bool takes_a_line() const;
  void write(const spdlog::details::log_msg& message);

  static inline std::uint64_t lost_ = 0;

  spdlog::sink_ptr inner_;
  int descriptor_;
  std::uint64_t untold_ = 0;  // lost since the last line
};

}  // namespace swarmtalk::daemon
