// How far a command to Kilobots is, for a person: a bar that is drawn over itself on a terminal, a
// line for each pass elsewhere.
#pragma once

#include <cstdint>
#include <string>

#include "ipc/framing.hpp"

namespace swarmtalk::cli {

/// "1:05"
std::string minutes_text(std::uint64_t ms);

/// "[#####-----] pass 2 of 6, page 12 of 56, 0:41 left"
std::string progress_text(const ipc::KilobotStarted& started, std::uint32_t passes,
                          const ipc::KilobotProgress& progress);

class ProgressDisplay {
 public:
  ProgressDisplay(const ipc::KilobotStarted& started, std::uint32_t passes, bool is_terminal)
      : started_(started), passes_(passes), is_terminal_(is_terminal) {}

  void show(const ipc::KilobotProgress& progress);
  /// Before anything else is printed.
  void end_line();

 private:
  const ipc::KilobotStarted& started_;
  std::uint32_t passes_;
  bool is_terminal_;
  bool is_line_open_ = false;
  std::uint32_t pass_ = 0;  // told
};

}  // namespace swarmtalk::cli
