// Refusal: why a request was not done, as the client is told (ipc.proto's Failure).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "ipc/ipc.pb.h"

namespace swarmtalk::daemon {

struct Refusal {
  ipc::ErrorCode code;
  std::string text;                    // one sentence for a person, with the remedy
  std::optional<std::uint64_t> limit;  // that was exceeded, in the unit of the request
};

}  // namespace swarmtalk::daemon
