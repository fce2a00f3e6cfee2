// Tells, once, why a listener may hear nothing: a channel's name that nobody uses, no other robot.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <swarmtalk/client.hpp>

#include "cli/common/deadline.hpp"

namespace swarmtalk::cli {

/// Too short ago for others to be heard.
bool has_just_begun(const DaemonStatus& daemon);

/// "there are no wildcards ..." when one of the names looks like one; empty: none does.
std::string wildcard_hint(const std::vector<std::string>& channels);

/// What a channel may have been meant to be that is published, while no program of this robot uses
/// it; empty: nothing.
std::string misspelt_text(const std::string& published, const DaemonStatus& daemon);

/// That perhaps nobody gets what is published: no other program of this robot listens, and no robot
/// was heard though there was time; empty: somebody may. Robots of a controller are not heard.
std::string unheard_text(const std::string& published, const DaemonStatus& daemon,
                         const std::vector<Neighbour>& neighbours);

/// What there is to say of channels on which nothing was heard; empty: nothing.
std::string silence_text(const std::vector<std::string>& silent, const DaemonStatus& daemon,
                         const std::vector<Neighbour>& neighbours);

class QuietWatch {
 public:
  /// @param client  must outlive it
  QuietWatch(Client& client, std::vector<std::string> channels)
      : client_(client), silent_(std::move(channels)) {}

  void heard(const std::string& channel);
  /// Something else has said why nothing is heard.
  void stop() { next_ = Clock::time_point::max(); }
  /// Called often; asks the daemon once, when the time has come.
  void look();
  /// When look() has something to do again.
  Clock::time_point next() const { return next_; }

 private:
  Client& client_;
  std::vector<std::string> silent_;  // channels on which nothing has come
  Clock::time_point next_ = Clock::now() + std::chrono::seconds(3);
};

}  // namespace swarmtalk::cli
