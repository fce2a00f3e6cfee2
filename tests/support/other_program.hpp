// Another program that has a serial device open: a child process, which ends with this object.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>

namespace swarmtalk::test {

class OtherProgram {
 public:
  /// Returns when it has the device open. @param kept  a descriptor of ours that it keeps; -1: none
  OtherProgram(const std::string& device, const char* name, int kept = -1) {
    constexpr unsigned kLongestLifeS = 120;
    constexpr int kMostDescriptors = 256;
    std::array<int, 2> pipe{};
    EXPECT_EQ(::pipe(pipe.data()), 0);
    pid_ = ::fork();
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::prctl(PR_SET_NAME, name);
      ::alarm(kLongestLifeS);
      for (int each = 3; each < kMostDescriptors; ++each) {
        if (each != pipe[1] && each != kept) ::close(each);
      }
      const char is_open = ::open(device.c_str(), O_RDONLY | O_NOCTTY) >= 0 ? 1 : 0;
      if (::write(pipe[1], &is_open, 1) != 1) ::_exit(1);
      for (;;) ::pause();
    }
    ::close(pipe[1]);
    char is_open = 0;
    EXPECT_EQ(::read(pipe[0], &is_open, 1), 1);
    EXPECT_EQ(is_open, 1);
    ::close(pipe[0]);
  }
  ~OtherProgram() { end(); }
  OtherProgram(const OtherProgram&) = delete;
  OtherProgram& operator=(const OtherProgram&) = delete;

  void end() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }
  int pid() const { return pid_; }

 private:
  pid_t pid_ = 0;
};

}  // namespace swarmtalk::test
