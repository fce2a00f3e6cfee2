// Swarm: what is known of every robot, from this daemon's own tables and from what robots tell of
// themselves. Plain values with the time at which they were true, so that everything shown has an
// age. Reads no clock: the caller passes the time. Used by the Observer, drawn by swarm_json.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <swarmtalk/client.hpp>

#include "report/report.hpp"

namespace swarmtalk::view {

using Clock = std::chrono::steady_clock;
using Time = Clock::time_point;

/// Where a robot was, and when.
struct Place {
  float x_m = 0;
  float y_m = 0;
  float theta_rad = 0;  // counter-clockwise from +x
  Time at{};
};

/// How well one robot hears another.
struct Hearing {
  float loss = 0;  // share of frames that do not come, 0 to 1
  Time at{};
};

struct SwarmRobot {
  std::uint32_t id = 0;
  std::uint32_t epoch = 0;  // of its daemon's start; 0: not known
  bool is_self = false;     // the one whose daemon we ask
  bool has_namesake = false;
  bool is_ghost = false;  // simulated, by its own word
  std::string name;       // that its configuration gives it; empty: not known
  std::optional<Place> place;
  std::optional<Time> heard_at;  // by our daemon itself, the last time
  std::optional<Time> told_at;   // the time for which somebody's report speaks of it
  std::string link, address;     // of hearing it ourselves
  float distance_m = Message::kUnknown;
  float bearing_rad = Message::kUnknown;
  std::uint64_t frames = 0, frames_lost = 0;
  std::map<std::uint32_t, Hearing> hears;                // by the id of who is heard
  std::map<std::string, std::string> values;             // harvested: key, value
  std::optional<std::vector<std::string>> programs;      // that it runs, as it tells
  std::map<std::uint16_t, report::ChannelUse> channels;  // as it tells
  std::optional<Loss> lost;                              // messages, by place, as it tells
};

class Swarm {
 public:
  static constexpr std::size_t kMostRobots = 1024;
  static constexpr std::size_t kMostHeard = 64;   // that one robot hears
  static constexpr std::size_t kMostValues = 64;  // harvested, of one robot
  static constexpr auto kForgetAfter = std::chrono::seconds(120);
  static constexpr auto kHearingKeptFor = std::chrono::seconds(60);

  /// Our own daemon's answer. Another node id than before: it has changed, and its old entry goes.
  void note_self(const DaemonStatus& status, Time now);
  /// The same without the rest, as a recording has it. @param pose  none: not known
  void note_own_pose(std::uint32_t id, const std::optional<Pose>& pose, Time now);
  /// It was heard by our daemon itself.
  void note_sign(std::uint32_t id, Time now);
  /// All whom our daemon hears now.
  void note_neighbours(const std::vector<Neighbour>& neighbours, Time now);
  /// A message's last transmitter told where it is. Only what is newer than what is known counts.
  void note_place(std::uint32_t id, const Pose& pose, Time now);
  /// What a robot reported of itself, at that time. Older than what is known: left out.
  void note_report(std::uint32_t id, const report::Facts& facts, Time said_at);
  void note_value(std::uint32_t id, const std::string& key, const std::string& value);

  /// The entry of a robot, made when there is none. @return null: kMostRobots are known, or id is 0
  SwarmRobot* robot(std::uint32_t id);
  const SwarmRobot* find(std::uint32_t id) const;
  void note_hearing(SwarmRobot& who, std::uint32_t heard, float loss, Time at);
  /// Takes a place when it is newer than the one that is known.
  static void take_place(SwarmRobot& robot, const Place& place);

  /// Removes robots of which nothing was heard for kForgetAfter, and hearings that are too old.
  void forget_old(Time now);

  const std::map<std::uint32_t, SwarmRobot>& robots() const { return robots_; }
  std::uint32_t self() const { return self_; }
  /// Robots that were left out because kMostRobots were known.
  std::uint64_t left_out() const { return left_out_; }

 private:
  std::map<std::uint32_t, SwarmRobot> robots_;
  std::uint32_t self_ = 0;
  std::uint64_t left_out_ = 0;
};

/// A link's loss after a message, before which so many were lost; over the last few dozen.
float loss_after(float loss, std::uint32_t lost_before);

/// When a robot was known to be there: heard, or told of. None: never.
std::optional<Time> last_sign(const SwarmRobot& robot);

}  // namespace swarmtalk::view
