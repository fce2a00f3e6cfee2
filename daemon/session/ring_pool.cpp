#include "daemon/session/ring_pool.hpp"

#include <signal.h>

#include <algorithm>
#include <cerrno>
#include <utility>

namespace swarmtalk::daemon {
namespace {

bool has_ended(std::uint32_t pid) {
  return pid != 0 && kill(static_cast<pid_t>(pid), 0) != 0 && errno == ESRCH;
}

}  // namespace

// A process that lives may still write where it wrote before, also when we have hung up.
std::optional<ipc::RingMemory> RingPool::take_kept(const ClientIdentity& client) {
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& each) {
    return each.client.uid == client.uid && (each.is_free || has_ended(each.client.pid));
  });
  if (found == kept_.end()) return std::nullopt;
  ipc::RingMemory memory = std::move(found->memory);
  kept_.erase(found);
  if (memory.capacity() == limits_.ring_bytes && memory.begin_again()) return memory;
  --size_;  // of another size, from before a reload: it makes room for a new one
  --made_[client.uid];
  return std::nullopt;
}

bool RingPool::may_make(const ClientIdentity& client) const {
  const auto made = made_.find(client.uid);
  const std::uint32_t most = client.uid == 0 ? limits_.clients : limits_.clients_per_user;
  return size_ < 2 * std::size_t{limits_.clients} && (made == made_.end() || made->second < most);
}

std::optional<ipc::RingMemory> RingPool::take(const ClientIdentity& client) {
  if (barred_.contains(client.uid)) return std::nullopt;
  if (auto kept = take_kept(client)) return kept;
  if (!may_make(client)) {
    errno = EDQUOT;
    return std::nullopt;
  }
  ipc::RingMemory made = ipc::RingMemory::create(limits_.ring_bytes);
  if (!made.is_valid()) return std::nullopt;
  ++size_;
  ++made_[client.uid];
  return made;
}

void RingPool::give_back(ipc::RingMemory memory, const ClientIdentity& client, bool has_left) {
  memory.unmap();
  kept_.push_back({std::move(memory), client, has_left});
}

}  // namespace swarmtalk::daemon
