// Sequence: the frames of one command to the robots (run, program, ...) with the time to leave each
// to the controller. Nothing is ever acknowledged, so a sequence that has been sent says nothing
// about what the robots did. Pure functions; Player walks through one.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "kilobot_bridge/pacing.hpp"

namespace swarmtalk::kilobot_bridge {

/// `hold` counts from the frame's last byte, in the controller's time; the line's own least silence
/// is kept beside it.
struct TimedFrame {
  OverheadFrame frame{};
  Duration hold{0};
};

struct Sequence {
  std::string name;                  // "run", "program"
  std::vector<TimedFrame> before;    // once
  std::vector<TimedFrame> repeated;  // `passes` times
  std::uint32_t passes = 0;          // 0 with `repeated`: until it is stopped
  std::vector<TimedFrame> after;     // once, also when it is stopped
  bool is_program = false;           // robots are left in their bootloader if it does not end
};

inline constexpr std::uint32_t kDefaultPasses = 6;
inline constexpr std::uint32_t kMostPasses = 1000;
inline constexpr std::size_t kLeastPages = 2;  // the stock bootloader can spoil a one-page program
/// Beyond it a program lies where the standard way into the bootloader leads through.
inline constexpr std::size_t kSafePages = 192;
inline constexpr std::size_t kMostProgramBytes = std::size_t{kProgramPages} * kProgramPageBytes;
inline constexpr std::uint8_t kMostMotorDuty = 120;  // above it motors wear out
inline constexpr std::size_t kMostPositions = 256;
inline constexpr Duration kMostHold = std::chrono::hours(1);  // longer: until it is stopped

/// The simple commands: one infrared message, held, then STOP.
enum class Command : std::uint8_t {
  kRun,
  kPause,  // WAKEUP to robots that are awake
  kReset,
  kSleep,
  kWakeup,  // to robots that sleep: they listen every 8 s only
  kCharge,
  kVoltage,
};

enum class Calibration : std::uint8_t { kTurnLeft = 2, kTurnRight = 3, kStraight = 4 };

Sequence command_sequence(Command command);
/// Every robot that hears it waits in its bootloader for a program.
/// @param may_sleep  as with program_sequence()
Sequence bootload_sequence(bool may_sleep);
/// The same command with its message held for another time: told anew each second, so that our
/// controller, which ends a repetition by itself, goes on, and ends soon when its host is dead.
/// @param sequence  with one frame that is held: of a Command, BOOT, a message or positions
/// @param hold  at most kMostHold; 0: until it is stopped
Sequence held(Sequence sequence, Duration hold);
/// STOP alone.
Sequence stop_sequence();
/// Toggles the controller's own LED, no more: a test of the line.
Sequence led_sequence();
/// Every robot that hears it gets this uid.
Sequence set_uid_sequence(std::uint16_t uid);
/// One bit of the uid: robots turn left while it is 1, stand while it is 0.
/// @param bits  0 to 15 each; the robots are told to stand still again behind the last
Sequence read_uid_sequence(std::span<const std::uint8_t> bits, bool ends_with_wakeup);
/// @param left, right  duty; turning uses the one of its side
Sequence calibrate_sequence(Calibration mode, std::uint8_t left, std::uint8_t right, bool saves,
                            bool stops);
/// One message of a program's own, types 0 to 0x7F, then STOP.
/// @param is_single  the controller knows kForwardSingle
Sequence message_sequence(std::uint8_t ir_type, const IrData& data, bool is_single);
/// The same with a checksum of the caller's own, right or wrong; never single.
Sequence raw_message_sequence(std::uint8_t ir_type, const IrData& data, std::uint16_t checksum);
/// Where robots are, each told once. @param records  1 to kMostPositions, none all zero
Sequence position_sequence(std::span<const GpsRecord> records);
/// A program for all robots in the controller's light.
/// @param image  1 to kMostProgramBytes bytes from address 0 on; padded with 0xFF
/// @param passes  0: until stopped
/// @param may_sleep  robots may be asleep: they are woken first for 12 s instead of 1 s
Sequence program_sequence(std::span<const std::uint8_t> image, std::uint32_t passes,
                          bool may_sleep);

/// Pages that an image of so many bytes takes.
std::size_t program_pages(std::size_t image_bytes);

/// Walks through a sequence, frame by frame.
class Player {
 public:
  Player(Sequence sequence, const Pacing& pacing);

  /// The next frame; none: it has ended.
  std::optional<TimedFrame> next();

  /// Goes on with `after` at the next call of next().
  void stop();
  bool is_stopped() const { return is_stopped_; }

  const Sequence& sequence() const { return sequence_; }
  std::uint32_t frames_sent() const { return frames_sent_; }
  std::uint32_t frames() const { return frames_; }  // in all; 0: until it is stopped
  std::uint32_t pass() const { return pass_; }      // in hand, from 1; 0: before the first
  std::uint32_t passes_sent() const { return passes_sent_; }
  std::uint32_t index() const { return index_; }  // of the last frame, in its part
  /// What is left, in the controller's time; of a pass, if passes are endless.
  Duration left() const { return left_; }

 private:
  enum class Part : std::uint8_t { kBefore, kRepeated, kAfter, kEnd };

  Duration time_of(const std::vector<TimedFrame>& frames) const;
  const std::vector<TimedFrame>& frames_of(Part part) const;
  void enter_next_part();

  Sequence sequence_;
  const Pacing& pacing_;
  Part part_ = Part::kBefore;
  std::size_t next_ = 0;
  std::uint32_t frames_ = 0;
  std::uint32_t frames_sent_ = 0;
  std::uint32_t pass_ = 0;
  std::uint32_t passes_sent_ = 0;
  std::uint32_t index_ = 0;
  Duration left_{0};
  bool is_stopped_ = false;
};

}  // namespace swarmtalk::kilobot_bridge
