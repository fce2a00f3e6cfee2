#include "lab/process.hpp"

#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "usage/ending_signals.hpp"

namespace swarmtalk::lab {
namespace {

using namespace std::chrono_literals;

constexpr int kExitCannotExecute = 127;

struct ProcStat {
  char state = 0;  // 'Z' is a zombie, 0: no such process
  unsigned long long start_time_ticks = 0;
};

ProcStat read_stat(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(file, line, '\0');  // nothing if the process has gone since the file was opened
  // The command name in parentheses may hold blanks and parentheses; fields count after the last.
  const auto name_end = line.rfind(')');
  if (name_end == std::string::npos) return {};
  std::istringstream fields(line.substr(name_end + 1));
  ProcStat stat;
  fields >> stat.state;
  std::string skipped;
  for (int field = 4; field < 22; ++field) fields >> skipped;
  fields >> stat.start_time_ticks;
  return stat;
}

void enter_namespace(const std::string& name) {
  const std::string path = "/run/netns/" + name;
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) throw std::runtime_error(path + ": " + std::strerror(errno));
  const int result = setns(fd, CLONE_NEWNET);
  close(fd);
  if (result != 0) throw std::runtime_error("entering " + path + ": " + std::strerror(errno));
}

/// Keeps a child from its program until the parent has written it down.
class Gate {
 public:
  Gate() {
    if (pipe2(fds_, O_CLOEXEC) != 0) throw std::runtime_error("pipe: out of descriptors");
  }
  ~Gate() {
    for (const int fd : fds_) {
      if (fd >= 0) close(fd);
    }
  }
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  void open() { [[maybe_unused]] const auto written = write(fds_[1], "", 1); }

  /// @return false when the parent has ended, or let go of it, without opening it
  bool wait() {
    close(fds_[1]);
    fds_[1] = -1;
    char opened = 0;
    ssize_t size = 0;
    while ((size = read(fds_[0], &opened, 1)) < 0 && errno == EINTR) {
    }
    return size == 1;
  }

 private:
  int fds_[2] = {-1, -1};
};

/// fork() whose child ends of a signal that ends programs: until it is another program it would
/// have our handlers, which only remember that one came.
pid_t fork_without_handlers() {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  const pid_t pid = fork();
  if (pid == 0) {
    for (const int signal : usage::kEndingSignals) {
      if (!usage::is_ignored(signal)) std::signal(signal, SIG_DFL);
    }
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return pid;
}

void redirect(int from, int to) {
  if (dup2(from, to) < 0) throw std::runtime_error(std::string("dup2: ") + std::strerror(errno));
}

}  // namespace

std::filesystem::path own_folder() {
  std::error_code unknown;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", unknown);
  return unknown ? "/usr/bin" : self.parent_path();
}

std::string find_program(const std::string& name) {
  if (name.find('/') != std::string::npos) return access(name.c_str(), X_OK) == 0 ? name : "";
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string file = (folder.empty() ? "." : folder) + "/" + name;
    if (access(file.c_str(), X_OK) == 0) return file;
  }
  return "";
}

ProcessId identify(pid_t pid) {
  const ProcStat stat = read_stat(pid);
  return {pid, stat.state == 'Z' ? 0 : stat.start_time_ticks};
}

bool is_running(const ProcessId& process) {
  return process.start_time_ticks != 0 &&
         identify(process.pid).start_time_ticks == process.start_time_ticks;
}

void end_processes(const std::vector<ProcessId>& processes, std::chrono::milliseconds grace) {
  auto any_running = [&] {
    while (waitpid(-1, nullptr, WNOHANG) > 0) {
    }
    for (const ProcessId& process : processes) {
      if (is_running(process)) return true;
    }
    return false;
  };
  auto signal_all = [&](int signal) {
    for (const ProcessId& process : processes) {
      if (is_running(process)) kill(process.pid, signal);
    }
  };
  auto wait_for_all = [&](std::chrono::milliseconds limit) {
    const auto deadline = std::chrono::steady_clock::now() + limit;
    while (any_running() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(10ms);
    }
  };
  signal_all(SIGTERM);
  wait_for_all(grace);
  signal_all(SIGKILL);
  wait_for_all(1s);
}

void execute(const std::vector<std::string>& command, const SpawnOptions& options) {
  if (!options.network_namespace.empty()) enter_namespace(options.network_namespace);
  for (const std::string& entry : options.environment) {
    const auto equals = entry.find('=');
    setenv(entry.substr(0, equals).c_str(), entry.substr(equals + 1).c_str(), 1);
  }
  std::vector<char*> arguments;
  for (const std::string& argument : command) {
    arguments.push_back(const_cast<char*>(argument.c_str()));
  }
  arguments.push_back(nullptr);
  execvp(arguments[0], arguments.data());
  throw std::runtime_error(command[0] + ": " + std::strerror(errno));
}

pid_t spawn(const std::vector<std::string>& command, const SpawnOptions& options) {
  const pid_t parent = getpid();
  Gate gate;
  const pid_t pid = fork_without_handlers();
  if (pid < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  if (pid > 0) {
    if (options.write_down) options.write_down(identify(pid));
    gate.open();
    return pid;
  }
  try {
    if (options.dies_with_parent) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (getppid() != parent) _exit(kExitCannotExecute);
    }
    if (options.detached) {
      setsid();
      const int null_fd = open("/dev/null", O_RDONLY);
      if (null_fd >= 0) redirect(null_fd, STDIN_FILENO);
    }
    int out = options.output_fd;
    if (!options.output_file.empty()) {
      out = open(options.output_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
      if (out < 0) throw std::runtime_error(options.output_file + ": " + std::strerror(errno));
    }
    if (out >= 0) {
      redirect(out, STDOUT_FILENO);
      if (!options.keeps_errors) redirect(out, STDERR_FILENO);
    }
    if (!gate.wait()) _exit(kExitCannotExecute);
    if (options.detached) close_range(STDERR_FILENO + 1, ~0U, 0);
    execute(command, options);
  } catch (const std::exception& error) {
    const std::string line = std::string("swarmtalk-lab: ") + error.what() + "\n";
    [[maybe_unused]] const auto written = write(STDERR_FILENO, line.data(), line.size());
  }
  _exit(kExitCannotExecute);
}

Output output_of(const std::vector<std::string>& command, const SpawnOptions& options) {
  int pipe_fds[2];
  if (pipe2(pipe_fds, O_CLOEXEC) != 0) throw std::runtime_error("pipe: out of descriptors");
  SpawnOptions own = options;
  own.output_fd = pipe_fds[1];
  own.dies_with_parent = true;
  const pid_t pid = spawn(command, own);
  close(pipe_fds[1]);
  Output output;
  char buffer[512];
  for (ssize_t n = 0; (n = read(pipe_fds[0], buffer, sizeof buffer)) != 0;) {
    if (n > 0) output.text.append(buffer, static_cast<std::size_t>(n));
    if (n < 0 && errno != EINTR) break;
  }
  close(pipe_fds[0]);
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  output.exit_code = exit_code(status);
  while (!output.text.empty() && output.text.back() == '\n') output.text.pop_back();
  return output;
}

void run_quietly(const std::vector<std::string>& command) {
  const Output output = output_of(command);
  if (output.exit_code == 0) return;
  std::string text;
  for (const std::string& word : command) text += word + " ";
  throw std::runtime_error("`" + text + "` failed: " + output.text);
}

int exit_code(int wait_status) {
  return WIFSIGNALED(wait_status) ? 128 + WTERMSIG(wait_status) : WEXITSTATUS(wait_status);
}

}  // namespace swarmtalk::lab
