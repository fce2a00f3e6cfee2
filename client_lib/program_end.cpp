#include "client_lib/program_end.hpp"

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <utility>
#include <vector>

#include "client_lib/engine.hpp"

namespace swarmtalk::client {
namespace {

struct Open {
  std::mutex mutex;
  std::vector<std::weak_ptr<Engine>> engines;
};

Open& open() {
  static Open its;
  return its;
}

void end_all() {
  if (LockingCall::is_any()) return;
  std::unique_lock lock(open().mutex, std::try_to_lock);  // of a child's parent it may be held
  if (!lock) return;
  const auto engines = std::exchange(open().engines, {});
  lock.unlock();
  for (const auto& each : engines) {
    if (const auto engine = each.lock()) engine->end_with_program();
  }
}

}  // namespace

void end_with_program(const std::shared_ptr<Engine>& engine) {
  Open& its = open();  // made before the end is asked for, so that it is still there at the end
  static const int is_asked_for = std::atexit(end_all);
  static_cast<void>(is_asked_for);
  const std::lock_guard lock(its.mutex);
  std::erase_if(its.engines, [](const auto& each) { return each.expired(); });
  its.engines.push_back(engine);
}

}  // namespace swarmtalk::client
