// Keepers: processes that take a lab down when what it depends on has ended, however that ended, so
// that no process, interface or namespace stays. One is there while `up` starts a lab, and as long
// as a `run`; another as long as the medium of a lab runs in a process.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "lab/folder_lock.hpp"
#include "lab/process.hpp"

namespace swarmtalk::lab {

/// Takes the lab down when this process ends while its lab.json names it as the one that the lab
/// belongs to, or before there is a lab.json. Helpers that this process runs (run_quietly) end with
/// it, and are waited for: what one of them is making is taken down as well.
class Keeper {
 public:
  Keeper() = default;
  Keeper(const Keeper&) = delete;
  Keeper& operator=(const Keeper&) = delete;
  ~Keeper();

  /// Begins to look after this process, then makes the lab's folder; call it while this process has
  /// one thread. Throws std::runtime_error when it cannot.
  /// @param make_folder  makes it and takes its lock, which this process and its helpers keep. The
  ///                     keeper takes it after them, unless another lab of that name was quicker:
  ///                     that one takes down what it finds
  /// @param why          the word that is left when the lab is taken down (leave_word)
  void begin(const std::string& lab_name, const std::function<FolderLock()>& make_folder,
             const std::string& why);

  /// Helpers are not waited for from now on: programs of the user's run as well.
  void wait_for_no_helpers();

  /// The keeper ends, and leaves everything as it is.
  void release();

 private:
  std::optional<FolderLock> lock_;
  int held_fd_ = -1;  // the keeper reads the end of it once this process and its helpers have ended
  ProcessId process_;
};

/// What of a lab's medium runs in a process of its own: serves until one of the signals comes that
/// are blocked when it is called. @return which
using Serve = std::function<int()>;

/// Runs `serve` as a child, in the lab called `name`, until SIGTERM: what stays of `up --medium
/// radio`. The two look after each other: when one is killed, the other takes the lab down. Called
/// by the hidden command `keep`. @return exit code
int keep_medium(const std::string& name, const Serve& serve);

/// The signals by which what serves is ended: SIGTERM by whoever takes the lab down, SIGUSR1 by the
/// kernel when its keeper has gone.
void block_ending_signals();

}  // namespace swarmtalk::lab
