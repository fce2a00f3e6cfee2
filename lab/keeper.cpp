#include "lab/keeper.hpp"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <ctime>
#include <exception>

#include "lab/lab.hpp"

namespace swarmtalk::lab {
namespace {

constexpr timespec kLook{0, 200'000'000};  // how often a keeper looks whether its `run` is there

/// Takes the lab down that has lost a part, and leaves word of it.
void take_down(const std::string& name, const std::string& why) {
  std::fprintf(stderr, "%s; the lab is taken down\n", why.c_str());
  State state;
  if (!load(name, state)) return;
  down(state);
  leave_word(name, why);
}

int serve_as_child(const std::string& name, const Serve& serve, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGUSR1);
  if (getppid() != parent) raise(SIGUSR1);
  try {
    const int ended_by = serve();
    if (ended_by == SIGUSR1) take_down(name, "the medium's keeper was killed");
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "swarmtalk-lab: %s\n", error.what());
    return 1;
  }
}

std::string end_of(int status) {
  if (WIFSIGNALED(status)) return "was ended by signal " + std::to_string(WTERMSIG(status));
  return "ended with " + std::to_string(WEXITSTATUS(status));
}

}  // namespace

void block_ending_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGUSR1, SIGCHLD}) sigaddset(&signals, signal);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
}

int keep(const std::string& name, const Serve& serve) {
  block_ending_signals();
  State state;
  if (!load(name, state)) return 1;
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) return 1;
  if (child == 0) _exit(serve_as_child(name, serve, parent));
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGCHLD);
  for (;;) {
    const bool is_told = sigtimedwait(&signals, nullptr, &kLook) == SIGTERM;
    int status = 0;
    if (waitpid(child, &status, WNOHANG) == child) {
      if (is_told) return 0;
      const bool could_not_begin = WIFEXITED(status) && WEXITSTATUS(status) != 0;
      if (could_not_begin) return 1;  // it has said why, and `up` takes everything down
      take_down(name, "the medium " + end_of(status));
      return 0;
    }
    const bool is_alone = state.keeper.pid != 0 && !is_running(state.keeper);
    if (!is_told && !is_alone) continue;
    end_processes({identify(child)}, std::chrono::seconds(2));
    if (is_alone) take_down(name, "the run that it belonged to was killed");
    return 0;
  }
}

}  // namespace swarmtalk::lab
