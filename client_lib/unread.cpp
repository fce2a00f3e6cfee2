#include "client_lib/unread.hpp"

namespace swarmtalk::client {

Unread::~Unread() {
  const bool is_for_c = tells_anyway.load();
  if (is_for_c || !is_read.load()) tell(label, why, !is_for_c);
}

void Unread::tell_anyway(const Status& status) {
  if (status.unread_) status.unread_->tells_anyway.store(true);
}

}  // namespace swarmtalk::client
