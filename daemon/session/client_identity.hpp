// ClientIdentity: who a client is: its process, as the kernel says, and the name it gave itself.
#pragma once

#include <cstdint>
#include <string>

#include "text/plain.hpp"

namespace swarmtalk::daemon {

struct ClientIdentity {
  std::string name;
  std::uint32_t pid = 0;           // 0: not known
  std::uint32_t uid = UINT32_MAX;  // not known: nobody's

  /// "pid 123, uid 1000"
  std::string peer() const { return "pid " + std::to_string(pid) + ", uid " + std::to_string(uid); }
  /// For the log: "client 'x' (pid 123, uid 1000)". The name cannot end its quotes.
  std::string who() const { return "client " + text::quoted(name) + " (" + peer() + ")"; }
};

}  // namespace swarmtalk::daemon
