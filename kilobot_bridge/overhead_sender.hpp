// OverheadSender: puts frames on the line towards the overhead controller, padded (FramePadding)
// and paced (Pacing), one at a time, and asks for the next only when the line is free: whatever
// waits elsewhere may still be replaced by something newer. It never leaves the controller
// repeating: when nothing follows, it sends STOP. Reads no clock and does no I/O of its own: its
// owner calls poll() at the times it asks for, so it runs in virtual time as well.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kilobot_bridge/frame_padding.hpp"
#include "kilobot_bridge/sequence.hpp"

namespace swarmtalk::kilobot_bridge {

/// The serial line, as the sender sees it.
class OverheadLine {
 public:
  virtual ~OverheadLine() = default;
  /// Hands bytes over without waiting. @return how many were taken
  virtual std::size_t write_line(std::span<const std::uint8_t> bytes) = 0;
  /// Whether all that was handed over has left, as far as the device can tell.
  virtual bool is_drained() = 0;
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The line is free. @return the next frame; none: nothing waits
  virtual std::optional<TimedFrame> next_frame() = 0;
};

class OverheadSender {
 public:
  using Time = std::chrono::steady_clock::time_point;

  struct Counters {
    std::uint64_t frames = 0;           // handed to the line whole
    std::uint64_t bytes = 0;            // padding included
    std::uint64_t padding_bytes = 0;    // of these
    std::uint64_t withheld_frames = 0;  // that must not leave (frame_problem); a bug elsewhere
  };

  /// All three are kept by reference.
  OverheadSender(const Pacing& pacing, OverheadLine& line, FrameSource& source);

  /// The line has been opened. Nothing is sent for `settle` (ours, unscaled by the pacing), then a
  /// STOP, so that the controller's state is known.
  /// @param asks_version  and then kVersion, which a stock controller takes for another STOP
  void open(Time now, Duration settle, bool asks_version = false);
  /// The line is gone; what was on it is lost.
  void close();

  /// Does all that is due. @return when to call again; Time::max(): when something waits
  Time poll(Time now);

  /// Does not wait for the end of a frame's hold, only for the silence that the line needs. Call
  /// poll() behind it.
  void cut_hold();

  /// How long the frame in hand still takes, its hold included; ours. 0: none.
  Duration left(Time now) const;

  /// Settled, and frames are asked for.
  bool is_ready() const { return is_ready_; }
  /// The line has taken nothing for longer than it can need; close it.
  bool has_stalled() const { return has_stalled_; }
  /// Two STOPs for a line that is about to be closed, at once and unpaced; the controller is idle
  /// then.
  std::vector<std::uint8_t> last_words();

  const Counters& counters() const { return counters_; }

 private:
  enum class State : std::uint8_t { kClosed, kSettling, kOnLine, kSilent, kFree };

  void put_on_line(const TimedFrame& frame, Time now);
  std::optional<TimedFrame> take();
  Time wait_for_line(Time now);
  void push_bytes();

  const Pacing& pacing_;
  OverheadLine& line_;
  FrameSource& source_;
  FramePadding padding_;
  Counters counters_;
  State state_ = State::kClosed;
  Time due_{};                       // when the state ends
  Duration silence_{0};              // at least, behind what is on the line; ours
  Duration hold_{0};                 // until the source is asked again, no less than that
  Time silent_until_{};              // at least
  std::vector<std::uint8_t> bytes_;  // on the line
  std::size_t handed_over_ = 0;      // of them
  unsigned stops_owed_ = 0;          // until a repetition counts as ended
  bool asks_version_ = false;        // still to be asked
  bool is_ready_ = false;
  bool has_stalled_ = false;
};

}  // namespace swarmtalk::kilobot_bridge
