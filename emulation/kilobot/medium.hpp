// Medium: the infrared light between all nodes. Takes every switching of a sender's LED and hands
// it to each station in range after a fixed delay, with the strength that the distance gives; loses
// whole frames and single pulses, and adds stray ones, as asked. Owned by Emulation; one thread.
//
// The delay is the same for all and as long as the scheduler's quantum, which makes the lockstep
// exact: what a node sends while it runs ahead of the others cannot reach them before they get
// there. Collisions need no rule of their own: light adds up in the receivers (IrFrontEnd).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "emulation/kilobot/ir_frame.hpp"
#include "emulation/kilobot/random.hpp"
#include "emulation/kilobot/signal_model.hpp"

namespace swarmtalk::emulator {

struct MediumSettings {
  double range_mm = 100;           // robot to robot
  double loss = 0;                 // probability that a receiver misses a frame, 0..1
  double pulse_loss = 0;           // probability that a receiver misses one pulse, 0..1
  double stray_pulses_per_s = 0;   // at each receiver, from elsewhere
  bool hears_itself = true;        // a robot's receiver sees its own LED
  std::uint64_t delay_ns = 8'000;  // = the quantum
  std::uint64_t seed = 1;
};

/// What a station that can receive gives to the medium.
class LightSink {
 public:
  virtual ~LightSink() = default;
  virtual void on_light(std::uint64_t time_ns, SignalStrength strength, bool is_rising) = 0;
};

struct Placement {
  double x_mm = 0;
  double y_mm = 0;
  double reach_mm = 0;  // as a sender; 0: the medium's range
};

struct SenderCounters {
  std::uint64_t frames = 0;   // complete messages
  std::uint64_t started = 0;  // leading start pulses, complete or not
  std::uint64_t lost = 0;     // (frame, receiver) pairs that the medium has lost
};

class Medium {
 public:
  explicit Medium(const MediumSettings& settings);

  /// @param sink  null for a station that only sends; must outlive the medium
  /// @return the station's number, counted from 0
  unsigned add_station(const Placement& placement, LightSink* sink);

  /// Moves a station; what it sends from now on arrives with the strength of the new distance.
  void move(unsigned station, double x_mm, double y_mm);

  /// A sender's LED goes on or off. Times of one sender must not fall.
  void switch_light(unsigned sender, std::uint64_t time_ns, bool is_on);

  /// Makes the stray pulses that begin before `until_ns`. Call once per quantum.
  void advance(std::uint64_t until_ns);

  const SenderCounters& counters(unsigned sender) const { return stations_[sender].counters; }

  /// Called with each complete message: sender, time of its first pulse, message.
  std::function<void(unsigned, std::uint64_t, const IrMessage&)> on_message;

 private:
  struct Path {
    unsigned to = 0;
    SignalStrength strength;
    bool loses_frame = false;  // the frame in the air
    bool is_lit = false;       // has had a rising edge, owes a falling one
    SignalStrength lit_with;
  };
  struct Station {
    Placement placement;
    LightSink* sink = nullptr;
    std::vector<Path> paths;
    bool is_stale = true;  // paths are to be computed again
    bool is_on = false;
    FrameDecoder decoder;
    std::uint64_t frame_start_ns = 0;
    SenderCounters counters;
    std::uint64_t next_stray_ns = UINT64_MAX;
  };

  void find_paths(unsigned sender);
  void follow_frame(unsigned sender, std::uint64_t time_ns);
  std::uint64_t stray_gap_ns();

  MediumSettings settings_;
  Random chance_;
  Random stray_chance_;
  std::vector<Station> stations_;
};

}  // namespace swarmtalk::emulator
