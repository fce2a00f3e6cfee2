// Node: one robot or overhead controller in the emulation: a processor with its own clock, its
// place in the medium, its serial line and, for a robot, its body. Owned by Emulation.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulation/kilobot/event_log.hpp"
#include "emulation/kilobot/local_clock.hpp"
#include "emulation/kilobot/mcu.hpp"
#include "emulation/kilobot/medium.hpp"
#include "emulation/kilobot/pty.hpp"
#include "emulation/kilobot/robot_body.hpp"
#include "emulation/kilobot/scenario.hpp"
#include "emulation/kilobot/scheduler.hpp"
#include "emulation/kilobot/terminal_reader.hpp"

namespace swarmtalk::emulator {

class Node : public Steppable, public LightSink {
 public:
  struct Context {
    const Scenario& scenario;
    Medium& medium;
    EventLog& log;
  };

  /// @param ohc     what is special about an overhead controller; null for a robot
  /// @param number  of this node in the scenario, for its own chance
  Node(const Context& context, const NodeSpec& spec, const OhcSpec* ohc,
       std::shared_ptr<const Image> image, unsigned number);

  void run_until(std::uint64_t time_ns) override;
  void on_light(std::uint64_t time_ns, SignalStrength strength, bool is_rising) override;

  /// Looks at LED, motors and watched variables, logs what has changed, and moves the body.
  void sample(std::uint64_t time_ns);

  /// Takes what a host has written to the terminal, as soon as it is there.
  void poll_terminal(std::uint64_t time_ns);
  /// The same in real time: what came until `wall_ns`, the wall-clock time that belongs to
  /// `time_ns`. However late the emulation is, a silence on the line keeps its length.
  void poll_terminal(std::uint64_t time_ns, std::uint64_t wall_ns);
  /// Puts bytes on the serial line, from a time on. The line is as fast as its baud rate, however
  /// fast the host has written.
  void queue_serial(const std::vector<std::uint8_t>& bytes, std::uint64_t time_ns);

  /// Logs the node's figures and saves its EEPROM, if asked.
  void finish(std::uint64_t time_ns);

  const Mcu& mcu() const { return mcu_; }
  /// A variable of the node's image. @throws std::out_of_range
  Symbol symbol(const std::string& name) const { return image_->symbols.at(name); }
  const std::string& name() const { return spec_.name; }
  const NodeSpec& spec() const { return spec_; }
  bool is_ohc() const { return ohc_.has_value(); }
  const BodyPose& pose() const { return pose_; }
  const Pty* terminal() const { return terminal_.get(); }
  unsigned station() const { return station_; }

 private:
  struct Watched {
    std::string name;
    std::uint16_t address = 0;
    unsigned size_bytes = 1;
    std::optional<std::uint64_t> value;
  };

  void find_watched(const std::vector<std::string>& watch);
  void sample_body(std::uint64_t time_ns);
  const MotorGain& motor_gain(std::uint64_t time_ns);
  void sample_watched(std::uint64_t time_ns);
  void take_serial_output(std::uint8_t byte);
  void log_serial_output(std::uint64_t time_ns);

  Context context_;
  NodeSpec spec_;
  std::optional<OhcSpec> ohc_;
  std::shared_ptr<const Image> image_;
  LocalClock clock_;
  Mcu mcu_;
  unsigned station_ = 0;
  std::unique_ptr<Pty> terminal_;
  std::unique_ptr<TerminalReader> terminal_reader_;  // in real time

  std::deque<std::uint8_t> serial_in_;
  std::uint64_t byte_ns_;  // one byte on the line
  std::uint64_t next_byte_ns_ = 0;
  std::vector<std::uint8_t> serial_out_;  // since the last line of the log
  std::uint64_t serial_out_ns_ = 0;

  FrameDecoder heard_;
  std::vector<Watched> watched_;
  std::optional<LedColour> led_;
  std::optional<MotorDuty> motors_;
  std::optional<bool> status_led_;
  BodyPose pose_;
  BodyPose reported_pose_;
  std::uint64_t moved_ns_ = 0;
  Random motor_chance_;
  MotorGain motor_bias_;  // for good
  MotorGain motor_gain_;  // until gain_until_ns_
  std::uint64_t gain_until_ns_ = 0;
  std::uint32_t resets_ = 0;
  std::uint32_t pages_ = 0;
  bool was_dead_ = false;
};

}  // namespace swarmtalk::emulator
