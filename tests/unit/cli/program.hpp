// swarmtalk-cli, run by a test: its words, its three streams, how it ended. On the test's thread.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace swarmtalk::test {

using Strings = std::vector<std::string>;

struct Result {
  int exit_code = -1;
  std::string out;
  std::string error;
};

/// A running swarmtalk-cli whose three streams are ours.
class Program {
 public:
  /// @param output  a file that takes standard output; none: read_line() and finish() give it
  /// @param terminal  at which it is started, and from which it reads; none: write() is its input
  explicit Program(const Strings& arguments, const char* output = nullptr,
                   const char* path = SWARMTALK_CLI, const char* terminal = nullptr) {
    int pipes[3][2];
    for (auto& ends : pipes) {
      if (::pipe2(ends, O_CLOEXEC) != 0) std::abort();
    }
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    if (terminal != nullptr) {
      ::posix_spawn_file_actions_addopen(&actions, 0, terminal, O_RDWR, 0);
    } else {
      ::posix_spawn_file_actions_adddup2(&actions, pipes[0][0], 0);
    }
    ::posix_spawn_file_actions_adddup2(&actions, pipes[1][1], 1);
    if (output != nullptr) ::posix_spawn_file_actions_addopen(&actions, 1, output, O_WRONLY, 0);
    ::posix_spawn_file_actions_adddup2(&actions, pipes[2][1], 2);
    std::vector<char*> words{const_cast<char*>(path)};
    for (const auto& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    posix_spawnattr_t attributes;  // SIGPIPE as a shell leaves it, whoever runs the tests
    ::posix_spawnattr_init(&attributes);
    sigset_t signals;
    ::sigemptyset(&signals);
    ::sigaddset(&signals, SIGPIPE);
    ::posix_spawnattr_setsigdefault(&attributes, &signals);
    const int session = terminal != nullptr ? POSIX_SPAWN_SETSID : 0;
    ::posix_spawnattr_setflags(&attributes, static_cast<short>(POSIX_SPAWN_SETSIGDEF | session));
    EXPECT_EQ(::posix_spawn(&pid_, path, &actions, &attributes, words.data(), environ), 0);
    ::posix_spawnattr_destroy(&attributes);
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(pipes[0][0]);
    ::close(pipes[1][1]);
    ::close(pipes[2][1]);
    in_ = pipes[0][1];
    out_ = pipes[1][0];
    error_ = pipes[2][0];
  }
  ~Program() {
    close_input();
    close_output();
    ::close(error_);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void write(const std::string& bytes) {
    for (std::size_t at = 0; at < bytes.size();) {
      const ssize_t count = ::write(in_, bytes.data() + at, bytes.size() - at);
      if (count <= 0) return;  // it reads no more
      at += static_cast<std::size_t>(count);
    }
  }
  void close_input() { close_once(in_); }
  void close_output() { close_once(out_); }
  void signal(int number) { ::kill(pid_, number); }
  std::string read_line() { return read(out_, '\n'); }
  std::string read_error_line() { return read(error_, '\n'); }
  std::string read_until(char last) { return read(out_, last); }
  /// What its descriptor is; empty: it is closed.
  std::string descriptor(int fd) const {
    std::error_code none;
    const std::string link = "/proc/" + std::to_string(pid_) + "/fd/" + std::to_string(fd);
    return std::filesystem::read_symlink(link, none);
  }
  /// Until it waits for something itself; at most a minute.
  void wait_until_it_waits() const {
    for (int i = 0; i < 60'000; ++i) {
      std::ifstream stream("/proc/" + std::to_string(pid_) + "/stat");
      std::string text;
      std::getline(stream, text);
      if (text.find(") S ") != std::string::npos) return;
      ::usleep(1000);
    }
    ADD_FAILURE() << "it does not wait";
  }

  Result finish() {
    close_input();
    Result result;
    if (out_ >= 0) result.out = read(out_, '\0');
    result.error = read(error_, '\0');
    int status = 0;
    ::waitpid(pid_, &status, 0);
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    return result;
  }

 private:
  static void close_once(int& fd) {
    if (fd >= 0) ::close(fd);
    fd = -1;
  }
  static std::string read(int fd, char until) {
    std::string bytes;
    char byte = 0;
    while (::read(fd, &byte, 1) == 1) {
      if (until != '\0' && byte == until) break;
      bytes += byte;
    }
    return bytes;
  }

  pid_t pid_ = -1;
  int in_ = -1;
  int out_ = -1;
  int error_ = -1;
};

}  // namespace swarmtalk::test
