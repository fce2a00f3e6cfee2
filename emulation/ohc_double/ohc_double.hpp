// OhcDouble: stands in for an overhead controller towards a host: the same frames, the same pace,
// the same damage. It never answers, as the real one never does. It has no clock: its owner tells
// it the time with every call, so it runs in virtual time as well as behind a pseudo terminal.
//
// Source of all times: measured on the standard controller's image, docs/kilobot-emulator.md.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "emulation/kilobot/ir_frame.hpp"
#include "emulation/ohc_double/frame_finder.hpp"

namespace swarmtalk::ohc_double {

using emulator::IrMessage;

inline constexpr std::uint64_t kByteNs = 260'417;       // 10 bits at 38400 baud
inline constexpr std::uint64_t kStartNs = 50'000;       // from a frame's end to the first light
inline constexpr std::uint64_t kMessageNs = 4'371'000;  // one message on infrared
inline constexpr std::uint64_t kPassNs = 10'400'000;    // message, LED on 3 ms, LED off 3 ms
inline constexpr std::uint64_t kPageMessageNs =
    4'443'000;  // from one message of a page to the next
inline constexpr std::uint64_t kPageDeafNs = 97'800'000;
inline constexpr std::uint64_t kGpsMessageNs = 4'494'000;
inline constexpr std::uint64_t kAfterglowNs = 20'000'000;  // LED after a page or positions
inline constexpr std::uint64_t kBootNs = 2'000'000'000;    // five flashes after power-on
inline constexpr unsigned kPageMessages = 22;
inline constexpr std::size_t kPageBytes = 128;
inline constexpr unsigned kGpsRecords = 16, kGpsRecordBytes = 8;
inline constexpr std::size_t kDeafBytes = 3;  // that the serial unit keeps while nobody reads

/// One infrared message that has been on the air.
struct Transmission {
  std::uint64_t start_ns = 0;
  IrMessage message{};
  bool is_damaged = false;  // bytes came in meanwhile; no robot can read it
};

class OhcDouble {
 public:
  struct Counters {
    std::uint64_t frames = 0;  // accepted, false ones included
    std::uint64_t false_frames = 0;
    std::uint64_t dangerous_frames = 0;  // false ones of a type that does something, 1..6
    std::uint64_t replaced_frames = 0;   // overwritten by the next before they were looked at
    std::uint64_t lost_bytes = 0;        // while it was deaf
    std::uint64_t good = 0;              // transmissions
    std::uint64_t damaged = 0;
  };

  /// @param boot_ns  time after 0 in which frames are received but not acted upon
  explicit OhcDouble(std::uint64_t boot_ns = kBootNs) : busy_until_ns_(boot_ns) {}

  /// Everything that happens until then. Times must not fall.
  void advance(std::uint64_t time_ns);
  /// A byte has come in completely. Advances to that time.
  void put(std::uint8_t byte, std::uint64_t time_ns);

  bool is_led_on() const { return is_led_on_; }
  bool is_repeating() const { return phase_ == Phase::kSending && repeats_; }
  bool is_deaf() const { return phase_ == Phase::kDeaf; }
  const Counters& counters() const { return counters_; }

  std::function<void(const Transmission&)> on_transmission;
  std::function<void(std::uint64_t time_ns, const FoundFrame&)> on_frame;

 private:
  enum class Phase : std::uint8_t {
    kBusy,     // start-up or afterglow: hears, does not act until busy_until_ns_
    kIdle,     // acts at once
    kSending,  // a message, in passes of kPassNs
    kDeaf      // a page or positions, until busy_until_ns_
  };

  void hear(std::uint8_t byte, std::uint64_t time_ns);
  bool step(std::uint64_t time_ns);
  void end_message();
  void act(std::uint64_t time_ns);
  void start_pass(std::uint64_t time_ns);
  void send_page(std::uint64_t time_ns, const Frame& frame);
  void send_positions(std::uint64_t time_ns, const Frame& frame);
  void report(const Transmission& transmission);

  Phase phase_ = Phase::kBusy;
  std::uint64_t busy_until_ns_;
  FrameFinder finder_;
  std::optional<Frame> waiting_;
  std::vector<std::uint8_t> kept_bytes_;
  bool repeats_ = false;
  Transmission current_;
  bool is_on_air_ = false;
  std::uint64_t pass_start_ns_ = 0;
  bool is_led_on_ = false;
  bool is_led_wanted_ = false;
  Counters counters_;
};

}  // namespace swarmtalk::ohc_double
