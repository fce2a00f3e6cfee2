#include "client_lib/unread.hpp"

namespace swarmtalk::client {

Unread::~Unread() {
  if (!is_read.load()) tell(label, why);
}

/// For a call whose answer the C interface had to look at itself.
void Unread::not_looked_at(const Status& status) {
  if (status.unread_) status.unread_->is_read.store(false);
}

}  // namespace swarmtalk::client
