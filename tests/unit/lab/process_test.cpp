// Processes that a lab finds again.
#include "lab/process.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <thread>

#include "lab/interrupt.hpp"

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

TEST(LabProcess, ThatIsInterruptedBeforeItsProgramBeginsEnds) {
  remember_interrupts();
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    SpawnOptions options;
    options.write_down = [signal](const ProcessId& process) { ::kill(process.pid, signal); };
    const pid_t pid = spawn({"sleep", "60"}, options);
    int status = 0;
    EXPECT_EQ(::waitpid(pid, &status, 0), pid);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal) << status;
  }
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);
}

}  // namespace
}  // namespace swarmtalk::lab
