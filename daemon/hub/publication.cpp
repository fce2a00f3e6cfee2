#include "daemon/hub/publication.hpp"

#include <algorithm>

#include "daemon/common/monotonic_ns.hpp"

namespace swarmtalk::daemon {

std::uint64_t Publication::waited_us() const {
  const std::uint64_t now_ns = monotonic_ns();
  return (now_ns - std::min(now_ns, sent_at_ns)) / 1000;
}

Publication& PublicationPool::take() {
  if (free_.empty()) {
    all_.push_back(std::make_unique<Publication>());
    free_.reserve(all_.size());
    free_.push_back(all_.back().get());
  }
  Publication& publication = *free_.back();
  free_.pop_back();
  static_cast<PublicationHead&>(publication) = {};  // the payload keeps its memory
  publication.serial = ++last_serial_;
  return publication;
}

}  // namespace swarmtalk::daemon
