// Processes that a lab finds again.
#include "lab/process.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <thread>

namespace swarmtalk::lab {
namespace {

TEST(LabProcess, ThatEndsWhileItIsLookedAtDoesNotRun) {
  for (int i = 0; i < 300; ++i) {
    const pid_t pid = ::fork();
    if (pid == 0) {
      for (;;) ::pause();
    }
    const ProcessId process = identify(pid);
    EXPECT_TRUE(is_running(process));
    const std::jthread end([pid] {
      ::kill(pid, SIGKILL);
      ::waitpid(pid, nullptr, 0);
    });
    while (is_running(process)) {
    }
    while (identify(pid).start_time_ticks == process.start_time_ticks) {  // until it is collected
    }
  }
}

}  // namespace
}  // namespace swarmtalk::lab
