// AirWatch: which channels are on the air, who publishes on them and how much, also where nobody
// here subscribes. It looks at the frames that the daemon captures for it, so it costs the daemon a
// copy of each frame while it runs, and nothing on the air. Sealed frames cannot be looked into.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "cli/common/deadline.hpp"
#include "cli/common/operator.hpp"
#include "cli/frames/air_frames.hpp"

namespace swarmtalk::cli {

struct AirPublisher {
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;     // of packets
  bool is_own = false;         // this robot
  bool is_heard = false;       // itself, not only through others
  std::uint32_t newest = 0;    // message
  std::uint32_t sequence = 0;  // packet of it
  Clock::time_point last{};
};

struct AirChannel {
  bool is_timestamped = false;
  std::uint64_t forwarded = 0;                       // packets that somebody sent on
  std::map<std::uint32_t, AirPublisher> publishers;  // by node id
};

class AirWatch {
 public:
  /// Of all channels; what others send is not listed.
  static constexpr std::size_t kMaxPublishers = 4096;

  explicit AirWatch(std::string socket_path) : socket_path_(std::move(socket_path)) {}

  /// Connects and begins. Again after a lost daemon: counts go on.
  Status open();
  /// Readable when look() has work; -1: there is no connection.
  int fd() const { return is_open_ ? daemon_->fd() : -1; }
  /// Takes in what has come; waits for nothing. @return kDisconnected: open() again
  Status look();

  const std::map<std::uint16_t, AirChannel>& channels() const { return channels_; }
  std::uint64_t frames() const { return frames_; }
  std::uint64_t sealed_frames() const { return sealed_; }
  std::uint64_t missed_frames() const { return missed_; }       // that we were too slow for
  std::uint64_t unlisted_packets() const { return unlisted_; }  // beyond kMaxPublishers

 private:
  void take(const ipc::Captured& captured);
  void take(const frame::Frame& frame, bool is_own);
  AirPublisher* publisher(AirChannel& channel, std::uint32_t node);

  std::string socket_path_;
  std::optional<OperatorConnection> daemon_;
  bool is_open_ = false;
  ipc::Envelope envelope_;
  std::map<std::uint16_t, AirChannel> channels_;
  std::size_t publishers_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t sealed_ = 0;
  std::uint64_t missed_ = 0;
  std::uint64_t unlisted_ = 0;
};

}  // namespace swarmtalk::cli
