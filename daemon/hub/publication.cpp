#include "daemon/hub/publication.hpp"

#include <algorithm>

namespace swarmtalk::daemon {

std::uint64_t PublicationHead::waited_us(std::uint64_t now_ns) const {
  return (now_ns - std::min(now_ns, sent_at_ns)) / 1000;
}

std::uint32_t PublicationHead::told_us(std::uint64_t now_ns) const {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(waited_us(now_ns), UINT32_MAX));
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
