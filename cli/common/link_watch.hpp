// LinkWatch: tells on stderr, for commands that listen, that no link is up and when one is again: a
// radio that is off is heard as silence. Asks the daemon for its status; runs no callback.
#pragma once

#include <swarmtalk/client.hpp>

#include "cli/common/deadline.hpp"

namespace swarmtalk::cli {

class LinkWatch {
 public:
  /// @param client  connected; outlives this object
  explicit LinkWatch(Client& client) : client_(client) {}

  /// Looks when it is time: at once the first time, then every two seconds. Waits for the daemon's
  /// answer, as Client::get_status() does. A daemon that is away tells nothing.
  void look();

  /// When look() will ask again; a wait must not be longer.
  Clock::time_point next() const { return next_; }
  /// Whether a link that is down was ever told.
  bool has_told() const { return has_told_; }

 private:
  void tell(const DaemonStatus& daemon);

  Client& client_;
  Clock::time_point next_ = Clock::time_point::min();
  bool is_told_dead_ = false;
  bool has_told_ = false;
};

}  // namespace swarmtalk::cli
