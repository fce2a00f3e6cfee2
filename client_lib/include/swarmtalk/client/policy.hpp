// Policy: which messages a subscription wants, and which go first when its program is busy. A
// value; every part has a default, and reads as a sentence:
//   Policy::latest().within(1.5f).known_distance_only()
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace swarmtalk {

/// Which messages a subscription wants, and which go first while it is busy.
struct Policy {
  std::optional<float> max_distance_m = std::nullopt;  // unset: any distance
  bool drop_unknown_distance = false;                  // drop where it is unknown
  std::optional<std::uint32_t> keep_last =
      std::nullopt;             // messages that wait; unset: the daemon's default
  bool latest_of_each = false;  // of these only the newest of each sender
  std::optional<std::chrono::milliseconds> max_age =
      std::nullopt;       // since reception, and in buffers before it
  bool looks_on = false;  // for people who look: it does not make a channel one in use

  /// Of what waits while the program is busy, only the newest message of the channel.
  static Policy latest() { return last(1); }
  /// Only the newest message of each sender.
  static Policy latest_from_each() {
    Policy policy;
    policy.latest_of_each = true;
    return policy;
  }
  /// The newest `count`; the oldest goes first. @param count  1 to the daemon's queue_messages_max
  static Policy last(std::uint32_t count) {
    Policy policy;
    policy.keep_last = count;
    return policy;
  }

  /// Only from within this distance. A message of unknown distance comes too, unless
  /// known_distance_only().
  Policy within(float metres) const {
    Policy policy = *this;
    policy.max_distance_m = metres;
    return policy;
  }
  /// Without messages whose distance is unknown.
  Policy known_distance_only() const {
    Policy policy = *this;
    policy.drop_unknown_distance = true;
    return policy;
  }
  /// A message that is older when its turn comes is dropped, and counted as lost.
  Policy no_older_than(std::chrono::milliseconds age) const {
    Policy policy = *this;
    policy.max_age = age;
    return policy;
  }
  /// Of a viewer or a recorder, which listens to what others use: it does not count as use.
  Policy looking_on() const {
    Policy policy = *this;
    policy.looks_on = true;
    return policy;
  }
};

}  // namespace swarmtalk
