// VirtualLog: the daemons' log in a virtual swarm, whose lines have the swarm's time. To stderr,
// unless it is silent, and into the course of things.
#pragma once

#include <memory>

#include "tests/virtual/course.hpp"

namespace spdlog {
class logger;
}

namespace swarmtalk::test {

class VirtualLog {
 public:
  explicit VirtualLog(Course& course);
  ~VirtualLog();
  VirtualLog(const VirtualLog&) = delete;
  VirtualLog& operator=(const VirtualLog&) = delete;

  /// Lines of level warning and above.
  int warnings() const { return warnings_; }

 private:
  int warnings_ = 0;
  std::shared_ptr<spdlog::logger> before_;  // spdlog's default
};

/// No virtual swarm prints its log from now on.
void silence_virtual_logs();

}  // namespace swarmtalk::test
