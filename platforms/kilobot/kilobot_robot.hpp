// A Kilobot as the Robot of platforms/robot.hpp: one SwarmTalk node over infrared, LED, motors.
// Lives on the main loop; joined with a program by run_robot_program().
#pragma once

#include <stdint.h>

#include "platforms/kilobot/board.hpp"
#include "platforms/kilobot/clock.hpp"
#include "platforms/kilobot/distance.hpp"
#include "platforms/kilobot/eeprom.hpp"
#include "platforms/kilobot/motors.hpp"
#include "platforms/kilobot/random.hpp"
#include "platforms/kilobot/runtime.hpp"
#include "platforms/robot.hpp"
#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk {
namespace kilobot {

/// Distance of a message's transmitter by this robot's calibration, in mm; kDistanceUnknown
/// without one, and for messages of an overhead controller, whose light tells nothing.
int16_t distance_mm(const IrReception& reception);

/// Type of the infrared messages that carry packets of profile P: formats share the air.
template <class P>
struct IrTypeOf;
template <>
struct IrTypeOf<core::Kilobot> {
  static constexpr uint8_t kType = kIrSwarmtalk;
};
template <>
struct IrTypeOf<core::Classic2020> {
  static constexpr uint8_t kType = kIrClassic2020;
};

/// @tparam P  wire format: core::Kilobot, or core::Classic2020 among robots with the firmware of
/// 2020
template <class P>
class BasicKilobotRobot {
 public:
  using Profile = P;
  using Distance = typename Profile::Sensing::Distance;
  static constexpr uint16_t kBodyMm = kilobot::kBodyMm;
  static constexpr uint32_t kTicksPerSecond = kilobot::kTicksPerSecond;
  static constexpr uint16_t kSpeedMmPerS = 10;  // calibrated motors, both
  static constexpr uint16_t kTurnDegPerS = 45;  // one of them

  BasicKilobotRobot() : node_(core::Port{&port_clock, &port_random, nullptr}) {}
  BasicKilobotRobot(const BasicKilobotRobot&) = delete;
  BasicKilobotRobot& operator=(const BasicKilobotRobot&) = delete;

  core::Swarmtalk<Profile>& swarmtalk() { return node_; }
  uint32_t clock() { return ticks(); }
  uint32_t random() { return random32(); }
  static Distance distance(int32_t mm) { return static_cast<Distance>(mm); }

  void led(platforms::Colour colour) { set_led(led_rgb8(colour.red, colour.green, colour.blue)); }

  void forward(uint32_t duration_ticks) {
    const MotorCalibration& speed = control().motors();
    control().motion().start(speed.straight_left, speed.straight_right, duration_ticks);
  }
  void left(uint32_t duration_ticks) {
    control().motion().start(control().motors().turn_left, 0, duration_ticks);
  }
  void right(uint32_t duration_ticks) {
    control().motion().start(0, control().motors().turn_right, duration_ticks);
  }
  void stop() { control().motion().stop(); }
  bool is_moving() { return control().motion().is_moving(); }

  /// A Kilobot has nobody to tell.
  void log(const char*, int32_t) {}

  /// Hands a message to the node if it carries one of its packets.
  void receive(const IrReception& reception) {
    const uint8_t type = reception.message.type;
    const bool is_from_overhead = kType == kIrSwarmtalk && type == kIrSwarmtalkFromOverhead;
    const bool is_from_robot = kType == kIrSwarmtalk ? is_swarmtalk(type) : type == kType;
    if (!is_from_robot && !is_from_overhead) return;
    node_.on_packet(reception.message.data, kPacketBytes, {distance_mm(reception)});
  }

  /// The node's next packet. @return false if it has none
  bool next(IrMessage& out) {
    out = {};
    if (node_.pull_packet(out.data) == 0) return false;
    out.type = kType == kIrSwarmtalk ? swarmtalk_type() : kType;
    return true;
  }

 private:
  static constexpr uint8_t kType = IrTypeOf<P>::kType;
  static constexpr uint8_t kPacketBytes = core::Wire<Profile>::kMtuBytes;
  static_assert(kPacketBytes <= kIrDataBytes, "a packet fits an infrared message");
  static uint32_t port_clock(void*) { return ticks(); }
  static uint32_t port_random(void*) { return random32(); }

  core::Swarmtalk<Profile> node_;
};

using KilobotRobot = BasicKilobotRobot<core::Kilobot>;
using ClassicKilobotRobot = BasicKilobotRobot<core::Classic2020>;

}  // namespace kilobot
}  // namespace swarmtalk
