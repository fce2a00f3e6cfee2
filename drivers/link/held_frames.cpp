#include "drivers/link/held_frames.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::drivers {

void HeldFrames::keep(Held frame) {
  drop_before(frame.arrival.received_at - kLongest);
  const std::size_t more = frame.bytes.size();
  const auto is_its = [&](const Owner& each) { return each.voice == frame.voice; };
  auto owner = std::find_if(owners_.begin(), owners_.end(), is_its);
  if (owner != owners_.end()) {
    const bool is_here =
        std::any_of(owner->frames.begin(), owner->frames.end(),
                    [&](const Held& each) { return each.counter == frame.counter; });
    if (is_here || owner->frames.size() >= kMostOfOne) return;
  }
  if (more > kMostBytes) return;
  while (size_ >= kMost || bytes_ + more > kMostBytes) drop_of_most();
  owner = std::find_if(owners_.begin(), owners_.end(), is_its);
  if (owner == owners_.end()) owner = owners_.insert(owner, {frame.voice, {}});
  ++size_;
  bytes_ += more;
  owner->frames.push_back(std::move(frame));
}

std::vector<HeldFrames::Held> HeldFrames::take(const frame::Freshness::Voice& voice) {
  const auto owner = std::find_if(owners_.begin(), owners_.end(),
                                  [&](const Owner& each) { return each.voice == voice; });
  if (owner == owners_.end()) return {};
  std::vector<Held> taken = std::move(owner->frames);
  owners_.erase(owner);
  size_ -= taken.size();
  for (const Held& each : taken) bytes_ -= each.bytes.size();
  std::sort(taken.begin(), taken.end(),
            [](const Held& a, const Held& b) { return a.counter < b.counter; });
  return taken;
}

void HeldFrames::drop_before(MonotonicTime time) {
  for (Owner& owner : owners_) {
    while (!owner.frames.empty() && owner.frames.front().arrival.received_at < time) {
      drop_oldest(owner);
    }
  }
  std::erase_if(owners_, [](const Owner& each) { return each.frames.empty(); });
}

void HeldFrames::drop_of_most() {
  const auto most = std::max_element(
      owners_.begin(), owners_.end(),
      [](const Owner& a, const Owner& b) { return a.frames.size() < b.frames.size(); });
  drop_oldest(*most);
  if (most->frames.empty()) owners_.erase(most);
}

void HeldFrames::drop_oldest(Owner& owner) {
  --size_;
  bytes_ -= owner.frames.front().bytes.size();
  owner.frames.erase(owner.frames.begin());
}

}  // namespace swarmtalk::drivers
