// Processes of the lab: started, found again after a restart of the tool, and ended. A process is
// known by its id and its start time, so that a reused id is never signalled.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace swarmtalk::lab {

struct ProcessId {
  pid_t pid = 0;
  unsigned long long start_time_ticks = 0;  // field 22 of /proc/PID/stat, clock ticks since boot
};

/// The folder of this very program; where /proc is not mounted, the one that it is installed in.
std::filesystem::path own_folder();

/// A program by path, or by name from $PATH; empty: there is none.
std::string find_program(const std::string& name);

/// The id of a running process. start_time_ticks is 0 when there is no such process.
ProcessId identify(pid_t pid);

/// True while this very process runs (a zombie does not).
bool is_running(const ProcessId& process);

/// Sends SIGTERM to all, and SIGKILL to those that have not ended after `grace`.
void end_processes(const std::vector<ProcessId>& processes, std::chrono::milliseconds grace);

struct SpawnOptions {
  std::string network_namespace;         // name under /run/netns; empty: the caller's
  std::string output_file;               // stdout and stderr are appended here; empty: inherited
  int output_fd = -1;                    // or go to this descriptor
  bool keeps_errors = false;             // stderr is inherited whatever becomes of stdout
  std::vector<std::string> environment;  // NAME=VALUE, added to the caller's
  bool detached = false;                 // own session, stdin from /dev/null, no other descriptor
  bool dies_with_parent = false;
  /// Called before the program begins, which it does only once this has returned: so that whatever
  /// runs is written down, however the caller ends. What it throws comes out of spawn().
  std::function<void(const ProcessId&)> write_down;
};

/// Forks and executes `command` (looked up in PATH). Throws std::runtime_error when it cannot.
pid_t spawn(const std::vector<std::string>& command, const SpawnOptions& options);

/// Replaces this process by `command`. Returns only by throwing.
[[noreturn]] void execute(const std::vector<std::string>& command, const SpawnOptions& options);

/// Runs a helper program to its end, or to the end of this process. Throws with its last error line
/// when it fails.
void run_quietly(const std::vector<std::string>& command);

struct Output {
  int exit_code = 0;
  std::string text;  // standard output and errors, without line ends behind
};

/// Runs a program to its end, or to the end of this process.
Output output_of(const std::vector<std::string>& command, const SpawnOptions& options = {});

/// Exit code as a shell gives it: 128 + signal for a signalled process.
int exit_code(int wait_status);

}  // namespace swarmtalk::lab
