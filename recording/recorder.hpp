// Recorder: what a client hears, as a recording: messages with their sensing, log lines, poses and
// losses, each on a topic of its own. Closes a chunk each second, so at most that is lost. The
// program's own thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include <swarmtalk/client/daemon_status.hpp>
#include <swarmtalk/client/message.hpp>

#include "recording/recorded.pb.h"
#include "recording/topic_writer.hpp"

namespace swarmtalk::recording {

inline constexpr std::string_view kChannelTopics = "/channel/";  // and the channel's name
inline constexpr std::string_view kLogTopic = "/log_lines";
inline constexpr std::string_view kPoseTopic = "/pose";
inline constexpr std::string_view kLossesTopic = "/losses";
inline constexpr std::string_view kValuesTopic = "/values";
/// Of the metadata records whose `set_by_ns` is by how much, and `time_ns` when, in the times of
/// the recording.
inline constexpr std::string_view kClockSetMetadata = "swarmtalk.clock_was_set";
inline constexpr std::string_view kHeardTopic = "/heard";

/// As it is recorded. @param channel  its name, or number in digits
HeardMessage to_record(const std::string& channel, const swarmtalk::Message& message);

/// Nanoseconds since 1970 for times of the steady clock. The offset is taken once: setting the
/// clock while recording moves nothing.
class RecordClock {
 public:
  using Steady = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kLeastStep{500};

  /// Of the system's clock to the steady one, in nanoseconds.
  static std::int64_t system_offset_ns();

  explicit RecordClock(std::int64_t offset_ns = system_offset_ns())
      : offset_ns_(offset_ns), offset_now_ns_(offset_ns) {}
  std::uint64_t ns(Steady::time_point time) const;

  /// By how much the system's clock was set since this was last called; none: by less than
  /// kLeastStep, or not at all. @param offset_ns  as it is now
  std::optional<std::chrono::nanoseconds> was_set(std::int64_t offset_ns = system_offset_ns());

 private:
  std::int64_t offset_ns_;
  std::int64_t offset_now_ns_;
};

class Recorder {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kChunkPeriod{1};

  /// As McapWriter::open().
  std::string open(const std::string& path, const std::string& library, bool replaces);

  // Each returns false after a failure: see problem(). The time is that of the event.
  bool heard(const std::string& channel, const swarmtalk::Message& message, Clock::time_point at);
  bool log_line(const swarmtalk::Message& message, Clock::time_point at);
  /// @param pose  none: it is not known
  bool own_pose(std::uint32_t robot, const std::optional<swarmtalk::Pose>& pose,
                Clock::time_point at);
  bool neighbour(const swarmtalk::Neighbour& neighbour, Clock::time_point at);
  bool losses(const swarmtalk::ChannelStatus& channel, Clock::time_point at);
  /// A message of somebody's schema, encoded.
  bool encoded(const std::string& topic, const McapSchema& schema, std::string_view bytes,
               Clock::time_point at);

  /// The system's clock was set, which moves no time of this recording: a metadata record says so.
  bool clock_was_set(std::chrono::nanoseconds by, Clock::time_point at);

  /// Closes the chunk when its second is over. Call at least at next_close().
  bool tick(Clock::time_point now);
  Clock::time_point next_close() const { return next_close_; }

  /// Writes the last chunk and the index. @return false: something is missing, see problem()
  bool finish() { return topics_.writer().finish(); }

  const std::string& problem() const { return topics_.writer().problem(); }
  const McapWriter& writer() const { return topics_.writer(); }
  const RecordClock& clock() const { return clock_; }

 private:
  RecordClock clock_;
  TopicWriter topics_;
  std::map<std::uint16_t, std::string> channel_topics_;  // by the name that each had first
  Clock::time_point next_close_{};
};

}  // namespace swarmtalk::recording
