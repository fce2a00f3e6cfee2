// The clock of this machine, which a Raspberry Pi has to be told.
#pragma once

#include <sys/timex.h>

#include <optional>

namespace swarmtalk::cli {

/// Whether the kernel's clock is kept right by somebody (adjtimex(2), STA_UNSYNC); none: it does
/// not say.
inline std::optional<bool> is_clock_synchronised() {
  timex answer{};
  if (::adjtimex(&answer) < 0) return std::nullopt;
  return (answer.status & STA_UNSYNC) == 0;
}

}  // namespace swarmtalk::cli
