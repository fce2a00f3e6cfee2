// Story: what happens to a swarm, drawn by one number: its robots and programs, what they send, and
// the faults that strike. A list of events, each with its time, so that a story can be told, run
// again, and shortened.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/virtual/air.hpp"

namespace swarmtalk::test {

using Milliseconds = std::chrono::milliseconds;

enum class Kind : std::uint8_t {
  kSend,      // `count` messages of `program`, at once
  kLoss,      // `share` of all frames is lost
  kTwice,     // `share` of all frames comes twice
  kAgain,     // `share` of all frames comes again, seconds later
  kDelay,     // `share` of all frames comes later, others before them
  kPieces,    // `share` of all reads and writes of streams ends after 1 to `count` bytes
  kLinkDown,  // a robot's link
  kAway,      // a robot is out of the others' reach
  kBusy,      // the medium takes no frames of a robot
  kStop,      // a robot's daemon ends, and starts again
  kEnd,       // a program ends with farewell, and starts again
  kKill,      // a program ends as by SIGKILL, and starts again
  kPause,     // a program reads nothing
  kReload,    // a robot's daemon reads its configuration again, with another beacon
  kOtherKey,  // a robot has another key, by a reload
  kClock,     // a robot's wall clock is set, by `count` seconds
  kRefuse,    // the kernel refuses to send a robot's frames
  kStall,     // a robot's daemon stands still
};
inline constexpr std::size_t kKinds = 18;
inline constexpr int kChannels = 3;
constexpr Milliseconds kLongestDelay(50);     // of kDelay
constexpr Milliseconds kLongestAgain(20000);  // after a frame, its copy
/// "loss"
const char* name_of(Kind kind);

struct Event {
  Milliseconds at{};
  Kind kind = Kind::kSend;
  int robot = 0;
  int program = 0;
  int channel = 0;
  int count = 0;
  double share = 0;
  Milliseconds lasts{};  // a fault's; it is over at the end of the story's troubles at the latest
  std::uint32_t ttl = 0;
  std::size_t bytes = 0;  // of each message, at least what names it
};

enum class Queue : std::uint8_t { kQueued, kNewest, kOneAtATime };
/// Of what waits for a program: as many as there is room for, the newest of each sender, or what is
/// young enough.
enum class Wants : std::uint8_t { kAll, kNewestOfEach, kFresh };

struct ProgramPlan {
  std::vector<int> sends;  // channels
  std::vector<int> hears;
  Queue queue = Queue::kQueued;
  std::uint32_t redundancy = 0;  // repair packets
  std::uint32_t copies = 1;      // each message is sent so many times
  bool has_callback = true;      // what became of each message sent is asked for
  Wants wants = Wants::kAll;
  std::uint32_t keeps = 64;  // messages that wait for it
  Milliseconds max_age{};    // of what is fresh
};

struct RobotPlan {
  Place place;
  int beacon_ms = 500;
  int key = 0;              // 0: none
  int rate_hz = 0;          // frames; 0: no limit
  bool has_little = false;  // memory: the least that its limits allow, or nearly
  std::vector<ProgramPlan> programs;
};

struct Story {
  std::uint64_t seed = 0;
  double range_m = 0;
  std::vector<RobotPlan> robots;  // robot n is robots[n - 1]
  std::vector<Event> events;      // by their time
  Milliseconds troubles{};        // how long they last
};

/// A swarm of 2 to 20 robots of one to three programs each, what they send, and what strikes.
Story draw_story(std::uint64_t seed);

/// A line for each robot and each event.
std::string told(const Story& story);

}  // namespace swarmtalk::test
