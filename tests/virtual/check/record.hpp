// Record: all that programs of a story have sent and heard, and what daemons say at its end. What
// the judge looks at; plain values.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/virtual/check/story.hpp"

namespace swarmtalk::test {

/// A message that send() took.
struct SentMessage {
  int robot = 0;
  int program = 0;
  int channel = 0;
  int run = 0;      // of the robot's daemon
  int process = 0;  // the program's, of all in the story
  std::uint32_t ttl = 0;
  bool is_final = false;  // sent when all troubles were over
  bool is_flush = false;  // of a robot to itself: what was lost is told before it
  std::chrono::steady_clock::time_point at{};
};

/// A message that a subscription heard.
struct HeardMessage {
  int sent = -1;     // its index in Record::sent; -1: nobody sent that
  std::string text;  // its beginning, for people
  std::uint32_t sender = 0;
  std::uint32_t epoch = 0;
  std::uint32_t number = 0;
  std::uint32_t hops = 0;
  bool is_local = false;
  std::uint64_t lost = 0;  // before it, by what is told
  std::uint64_t late = 0;
  std::optional<std::chrono::steady_clock::time_point> received_at;
};

/// A fault, when it was there: later than in the story, where a call waited for a daemon that stood
/// still.
struct Strike {
  Kind kind = Kind::kSend;
  int robot = 0;
  std::chrono::steady_clock::time_point begin{};
  std::chrono::steady_clock::time_point end{};
};

/// A robot has this key from now on; before its first change, that of the story.
struct KeyChange {
  int robot = 0;
  std::chrono::steady_clock::time_point at{};
  int key = 0;
};

/// One subscription while it is registered with one daemon.
struct Hearing {
  int robot = 0;
  int program = 0;
  int channel = 0;
  int run = 0;                  // of the robot's daemon
  int process = 0;              // the program's
  bool is_spared = false;       // it may miss what waits for it: by its queue or by age
  bool is_open = false;         // until the end of the story
  std::size_t sent_before = 0;  // messages in Record::sent, when it began
  std::vector<HeardMessage> heard;
};

/// One publisher while it is there.
struct Publishing {
  int robot = 0;
  int program = 0;
  int channel = 0;
  std::uint64_t accepted = 0;
  std::uint64_t answered = 0;  // calls of its SentCallback
  std::uint64_t unsent = 0;    // of these: the daemon says that the message has not left, and no
                               // part and no copy of it can have
  bool is_open = false;        // until the end of the story
  bool has_callback = true;
};

/// Of a robot: its link, by its counters and by the air, and what its programs were handed.
struct Account {
  int robot = 0;
  std::uint64_t told_sent = 0;
  std::uint64_t sent = 0;
  std::uint64_t told_heard = 0;  // taken or dropped, for whatever reason
  std::uint64_t heard = 0;
  std::uint64_t taken = 0;             // of those, by the daemon
  std::uint64_t different = 0;         // of those that came, without copies
  std::uint64_t deliveries = 0;        // queued for its programs
  std::uint64_t deliveries_ended = 0;  // sent to them, or dropped for whatever reason
};

/// What a robot's daemon holds at a moment, of something that has a limit.
struct Use {
  int robot = 0;
  std::string what;
  std::uint64_t used = 0;
  std::uint64_t limit = 0;
};

/// What waits at a robot's end, by its daemon.
struct Leftovers {
  int robot = 0;
  std::uint64_t waiting_messages = 0;
  std::uint64_t publishers = 0;
  std::uint64_t subscriptions = 0;
  std::uint64_t channel_publishers = 0;  // the same, as its channels count them
  std::uint64_t channel_subscriptions = 0;
};

struct Record {
  int processes = 0;  // of programs, until now
  std::vector<SentMessage> sent;
  std::vector<Hearing> hearings;
  std::vector<Publishing> publishings;
  std::vector<Strike> strikes;
  std::vector<KeyChange> key_changes;
  std::vector<Use> uses;
  std::vector<Account> accounts;
  std::vector<Leftovers> leftovers;
  std::set<int> same_after_restart;  // robots: two starts of their daemons are one to all others
  std::vector<std::string> broken;   // promises that do not need the judge
  std::array<std::uint64_t, kKinds> struck{};
  std::uint64_t course = 0;
  double seconds = 0;  // of swarm time
};

}  // namespace swarmtalk::test
