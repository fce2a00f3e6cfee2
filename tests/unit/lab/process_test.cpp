// Processes that a lab finds again.
#include "lab/process.hpp"

#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <string>
#include <thread>
#include <utility>

#include "lab/interrupt.hpp"
#include "lab/network_namespace.hpp"

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

/// What is in the way of namespaces once this thread has given up one capability.
std::string problem_without(int capability) {
  std::string problem;
  std::jthread([&] {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct sets[_LINUX_CAPABILITY_U32S_3]{};
    ASSERT_EQ(syscall(SYS_capget, &header, sets), 0);
    sets[CAP_TO_INDEX(capability)].effective &= ~CAP_TO_MASK(capability);
    ASSERT_EQ(syscall(SYS_capset, &header, sets), 0);
    problem = namespace_problem("udp");
  }).join();
  return problem;
}

TEST(LabNamespaces, OfARootWithoutACapabilityAreNotTried) {
  if (!namespace_problem("udp").empty()) GTEST_SKIP() << "network namespaces need root";
  for (const auto& [capability, name] :
       {std::pair(CAP_SYS_ADMIN, "CAP_SYS_ADMIN"), std::pair(CAP_NET_ADMIN, "CAP_NET_ADMIN"),
        std::pair(CAP_NET_RAW, "CAP_NET_RAW")}) {
    const std::string problem = problem_without(capability);
    EXPECT_NE(problem.find(name), std::string::npos) << problem;
    EXPECT_NE(problem.find("--medium udp"), std::string::npos) << problem;
  }
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  EXPECT_NE(namespace_problem("udp").find("iproute2"), std::string::npos);
  setenv("PATH", path.c_str(), 1);
}

}  // namespace
}  // namespace swarmtalk::lab
