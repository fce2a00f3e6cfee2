// Traffic: what is heard on the channels: rates, who speaks, what was lost, and log lines. Bounded
// tables and lists; reads no clock. Filled by the Observer.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "view/scene/log_line.hpp"
#include "view/scene/swarm.hpp"

namespace swarmtalk::view {

/// Events per second over the last whole seconds.
class Rate {
 public:
  static constexpr std::size_t kSeconds = 5;

  void count(Time now);
  /// Mean over the kSeconds seconds before the present one, or those since the first event.
  double per_second(Time now) const;

 private:
  std::int64_t second_ = 0;                       // of the newest slot
  std::optional<std::int64_t> first_;             // second of the first event
  std::array<std::uint32_t, kSeconds + 1> in_{};  // a ring, one for each second
};

/// One message as a window of live messages shows it.
struct HeardMessage {
  std::uint64_t number = 0;  // of all that came, from 1: tells what a window has missed
  std::uint16_t channel = 0;
  std::uint32_t sender = 0;
  std::uint32_t transmitter = 0;  // the robot that it was heard from; 0: not known
  std::uint32_t hops = 0;
  bool is_local = false;
  float distance_m = Message::kUnknown;
  float bearing_rad = Message::kUnknown;
  Loss lost_before;
  std::string payload;
  Time at{};
  std::size_t unknown_bytes = 0;  // size of a payload that was not recorded
};

struct ChannelTraffic {
  std::uint16_t number = 0;
  std::string name;                               // empty: not known
  std::uint32_t publishers = 0, subscribers = 0;  // on our own daemon
  std::uint64_t messages = 0, bytes = 0;
  Rate rate;
  std::map<std::uint32_t, Time> senders;  // when each was heard last
  Loss lost;
  std::optional<Time> last;
};

class Traffic {
 public:
  static constexpr std::size_t kMostChannels = 128;
  static constexpr std::size_t kMostSenders = 256;     // of one channel
  static constexpr std::size_t kMostLines = 500;       // of the log
  static constexpr std::size_t kMostLineBytes = 1000;  // the rest of a longer one is cut

  /// Of more than kMostChannels, one that nobody here uses is forgotten. @return null: there is
  /// none
  ChannelTraffic* channel(std::uint16_t number);
  void note_status(const DaemonStatus& status);
  /// @return its number of all messages
  std::uint64_t note_message(const Message& message, Time now);
  const LogLine& note_line(std::uint32_t robot, std::string text, Time now);

  const std::map<std::uint16_t, ChannelTraffic>& channels() const { return channels_; }
  const std::deque<LogLine>& lines() const { return lines_; }
  std::uint64_t messages() const { return messages_; }

 private:
  bool forget_one_unused();

  std::map<std::uint16_t, ChannelTraffic> channels_;
  std::deque<LogLine> lines_;
  std::uint64_t messages_ = 0;
  std::uint64_t line_count_ = 0;
};

}  // namespace swarmtalk::view
