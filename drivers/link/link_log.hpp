// The links' logger, "link": the daemon may register its own under that name; else it is made from
// spdlog's default.
#pragma once

#include <spdlog/logger.h>

#include <memory>

namespace swarmtalk::drivers {

std::shared_ptr<spdlog::logger> link_log();

}  // namespace swarmtalk::drivers
