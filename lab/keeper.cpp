#include "lab/keeper.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <thread>

#include "lab/interrupt.hpp"
#include "lab/lab.hpp"

namespace swarmtalk::lab {
namespace {

using namespace std::chrono_literals;

constexpr int kLookMs = 500;          // how often a keeper looks whether what it looks after runs
constexpr int kLooksForHelpers = 10;  // without it, until helpers that do not end are left alone
constexpr int kLooksForLock = 3000;   // of a lab that somebody else looks at

/// Takes the lab down that has lost a part, and leaves word of it.
void take_down(const State& state, const std::string& why) {
  std::fprintf(stderr, "%s; the lab is taken down\n", why.c_str());
  leave_word(state.name, why);
  down(state);
}

void take_down(const std::string& name, const std::string& why) {
  State state;
  if (load(name, state)) take_down(state, why);
}

/// Until the other end of `fd` is closed: `kept` and its helpers have ended.
void wait_for_end(int fd, const ProcessId& kept) {
  for (int looks = 0; looks < kLooksForHelpers;) {
    pollfd end{fd, POLLIN, 0};
    if (poll(&end, 1, kLookMs) > 0) return;
    if (!is_running(kept)) ++looks;
  }
}

/// What is left of the lab of an `up` or `run` that has ended, unless somebody else does it.
void take_down_what_is_left(const std::string& name, const ProcessId& kept,
                            const std::string& why) {
  for (int looks = 0; looks < kLooksForLock; ++looks) {
    State state;
    state.name = name;
    const auto lock = FolderLock::try_take(name);
    const bool is_written = load(name, state);
    if (is_written ? state.keeper.pid != kept.pid : !std::filesystem::exists(folder_of(name)))
      return;
    if (lock) return is_written ? take_down(state, why) : forget(state);
    std::this_thread::sleep_for(10ms);
  }
}

/// Of a fork: in a session of its own, with nothing of the caller's but one descriptor.
void become_keeper(int end_fd) {
  remember_interrupts();  // none of them ends it
  setsid();
  const int null_fd = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(null_fd, fd);
  const auto end = static_cast<unsigned>(end_fd);
  if (end > STDERR_FILENO + 1U) close_range(STDERR_FILENO + 1, end - 1, 0);
  close_range(end + 1, ~0U, 0);
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

Keeper::~Keeper() {
  if (held_fd_ >= 0) close(held_fd_);
}

void Keeper::begin(const std::string& lab_name, const std::function<FolderLock()>& make_folder,
                   const std::string& why) {
  int fds[2];
  if (pipe2(fds, O_CLOEXEC) != 0) throw std::runtime_error("pipe: out of descriptors");
  const ProcessId kept = identify(getpid());
  const pid_t child = fork();
  if (child == 0) {
    try {
      become_keeper(fds[0]);
      wait_for_end(fds[0], kept);
      take_down_what_is_left(lab_name, kept, why);
    } catch (const std::exception&) {  // `down` can do the rest
    }
    _exit(0);
  }
  close(fds[0]);
  held_fd_ = fds[1];
  if (child < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  process_ = identify(child);
  lock_.emplace(make_folder());
  // For helpers; what runs on without us closes them.
  for (const int fd : {held_fd_, lock_->fd()}) fcntl(fd, F_SETFD, 0);
}

void Keeper::wait_for_no_helpers() {
  for (const int fd : {held_fd_, lock_->fd()}) fcntl(fd, F_SETFD, FD_CLOEXEC);
}

void Keeper::release() {
  if (!is_running(process_)) return;
  kill(process_.pid, SIGKILL);
  while (waitpid(process_.pid, nullptr, 0) < 0 && errno == EINTR) {
  }
}

int keep_medium(const std::string& name, const Serve& serve) {
  block_ending_signals();
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) return 1;
  if (child == 0) _exit(serve_as_child(name, serve, parent));
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGCHLD);
  for (;;) {
    const bool is_told = sigwaitinfo(&signals, nullptr) == SIGTERM;
    int status = 0;
    if (waitpid(child, &status, WNOHANG) == child) {
      if (is_told) return 0;
      const bool could_not_begin = WIFEXITED(status) && WEXITSTATUS(status) != 0;
      if (could_not_begin) return 1;  // it has said why, and `up` takes everything down
      take_down(name, "the medium " + end_of(status));
      return 0;
    }
    if (!is_told) continue;
    end_processes({identify(child)}, std::chrono::seconds(2));
    return 0;
  }
}

}  // namespace swarmtalk::lab
