// Which other programs have a serial device open: whatever they read is missing here. Asked by the
// kilobot link when it opens a device, and by doctor. Reads /proc, so only root sees them all.
#pragma once

#include <string>
#include <vector>

namespace swarmtalk::serial {

struct Holder {
  int pid = 0;
  std::string program;  // its name, as it may be shown
};

struct Holders {
  std::vector<Holder> seen;  // by process id
  bool are_all = true;       // false: there are processes that this one may not look into
};

/// Other programs that have the device open under whatever name. Not the one that made a pseudo
/// terminal and keeps its near end. Costs some milliseconds where many programs run.
Holders other_holders(const std::string& device);

/// Whether one still has it; one that may not be looked into has it as long as it runs.
bool still_holds(const Holder& holder, const std::string& device);

/// "pid 123 (cat), pid 124 (getty)"
std::string text_of(const std::vector<Holder>& holders);

}  // namespace swarmtalk::serial
