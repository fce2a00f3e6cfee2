#include "drivers/link/link_log.hpp"

#include <spdlog/spdlog.h>

namespace swarmtalk::drivers {

std::shared_ptr<spdlog::logger> link_log() {
  std::shared_ptr<spdlog::logger> logger = spdlog::get("link");
  return logger ? logger : spdlog::default_logger()->clone("link");
}

}  // namespace swarmtalk::drivers
