// From a client's command to the frames that carry it out, or to the reason why not.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/message/refusal.hpp"
#include "ipc/framing.hpp"
#include "kilobot_bridge/sequence.hpp"

namespace swarmtalk::daemon {

struct KilobotPlan {
  kilobot_bridge::Sequence sequence;
  std::vector<std::string> warnings;
  std::uint32_t pages = 0;  // of a program
};

/// @param has_single  the link's controller knows single messages
/// @param plan  set when there is no refusal
std::optional<Refusal> plan_kilobot_command(const ipc::KilobotCommand& command, bool has_single,
                                            KilobotPlan& plan);

}  // namespace swarmtalk::daemon
