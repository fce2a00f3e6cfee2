// Reports: the question to the swarm while somebody looks, and what comes back. Reports of all
// robots are heard, whoever asked for them. Reads no clock.
#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "view/scene/swarm.hpp"

namespace swarmtalk::view {

class Reports {
 public:
  static constexpr std::uint8_t kLookSeconds = 60;

  /// Details of this robot are wanted from now on; of the last few that were.
  void want(std::uint32_t robot);
  /// Whether more is wanted than look() has asked for.
  bool has_new_wish() const { return has_new_wish_; }

  /// The question, as a message of the channel "harvest".
  std::string look();

  /// Takes a report's records into the swarm. @return false: the message is something else
  bool take(const Message& message, Swarm& swarm, Time now);

 private:
  std::deque<std::uint16_t> wanted_;
  bool has_new_wish_ = false;
};

}  // namespace swarmtalk::view
