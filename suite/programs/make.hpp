// Makes a program of the suite for a robot: role and number become what its constructor takes.
// Programs know nothing of this; each platform's joining code on a host calls it.
#pragma once

#include <stdint.h>

#include "suite/programs/edge_following.hpp"
#include "suite/programs/firefly.hpp"
#include "suite/programs/hop_count.hpp"
#include "suite/programs/news.hpp"

namespace swarmtalk {
namespace suite {

/// @tparam Slot  like std::optional<Program>: has emplace()
template <class Slot, class Robot, uint8_t kSeeds>
void make(Slot& slot, BasicHopCount<Robot, kSeeds>*, Robot& robot, int role, uint32_t) {
  slot.emplace(robot, static_cast<HopCountRole>(role));
}
template <class Slot, class Robot, bool kUsesDelay>
void make(Slot& slot, BasicFirefly<Robot, kUsesDelay>*, Robot& robot, int, uint32_t) {
  slot.emplace(robot);
}
template <class Slot, class Robot>
void make(Slot& slot, EdgeFollowing<Robot>*, Robot& robot, int role, uint32_t number) {
  slot.emplace(robot, static_cast<EdgeRole>(role), static_cast<uint8_t>(number));
}

template <class Slot, class Robot>
void make(Slot& slot, News<Robot>*, Robot& robot, int role, uint32_t number) {
  slot.emplace(robot, static_cast<NewsRole>(role), static_cast<uint16_t>(number));
}

/// Calls run(static_cast<Program<Robot>*>(nullptr)) with the program of that name.
/// @return false if there is none
template <class Robot, class Name, class Run>
bool with_program(const Name& name, Run run) {
  if (name == "hop_count") {
    run(static_cast<HopCountOneSeed<Robot>*>(nullptr));
  } else if (name == "hop_count_two_seeds") {
    run(static_cast<HopCount<Robot>*>(nullptr));
  } else if (name == "firefly") {
    run(static_cast<Firefly<Robot>*>(nullptr));
  } else if (name == "firefly_no_delay") {
    run(static_cast<FireflyNoDelay<Robot>*>(nullptr));
  } else if (name == "edge_following") {
    run(static_cast<EdgeFollowing<Robot>*>(nullptr));
  } else if (name == "news") {
    run(static_cast<News<Robot>*>(nullptr));
  } else {
    return false;
  }
  return true;
}

}  // namespace suite
}  // namespace swarmtalk
