// What the suite's programs for a host share: they end on Ctrl-C with what they have, write a log
// that is whole or an error, and tell why they cannot run in one line.
#pragma once

#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

#include "usage/ending_signals.hpp"

namespace swarmtalk::suite {

/// Not 0 from the first SIGINT, SIGTERM or SIGHUP on.
inline volatile std::sig_atomic_t stopped = 0;

/// A log that is being written.
class LogFile {
 public:
  /// @throws std::runtime_error when it cannot be made
  explicit LogFile(const std::string& path) : path_(path), file_(std::fopen(path.c_str(), "w")) {
    if (!file_) throw std::runtime_error("cannot write " + path);
  }

  std::FILE* get() const { return file_.get(); }

  /// @throws std::runtime_error when not all of it could be written
  void finish() {
    const bool failed = std::ferror(file_.get()) != 0;
    if (std::fclose(file_.release()) != 0 || failed) {
      throw std::runtime_error("cannot write " + path_ + ": is the disk full?");
    }
  }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
};

/// A program's main(): from here on SIGINT, SIGTERM and SIGHUP set `stopped`.
/// @param run  the program, with its exit code; may throw
template <class Run>
int program_main(const char* name, Run run) {
  usage::catch_ending_signals([](int) { stopped = 1; }, SA_RESTART);
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 1;
  }
}

}  // namespace swarmtalk::suite
