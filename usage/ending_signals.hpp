// The signals that ask a program to end: Ctrl-C, `kill`, and a terminal or SSH session that goes
// away.
#pragma once

#include <signal.h>

namespace swarmtalk::usage {

inline constexpr int kEndingSignals[] = {SIGINT, SIGTERM, SIGHUP};

/// Ignored by whoever started this program, as `nohup` does with SIGHUP: it is to go on.
inline bool is_ignored(int signal) {
  struct sigaction now {};
  return ::sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

/// From here on each of them calls `handler`, but for those that are ignored.
/// @param flags  of sigaction(2): with SA_RESTART calls that wait go on, without they end with
/// EINTR
inline void catch_ending_signals(void (*handler)(int), int flags) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  ::sigemptyset(&action.sa_mask);
  for (const int signal : kEndingSignals) {
    if (!is_ignored(signal)) ::sigaction(signal, &action, nullptr);
  }
}

}  // namespace swarmtalk::usage
