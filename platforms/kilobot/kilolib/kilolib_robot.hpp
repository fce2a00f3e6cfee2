// The Robot of platforms/robot.hpp on kilolib, for those who want to keep it: the same programs and
// the same messages on the air, with kilolib's radio, states and costs. Built only when the folder
// of an installed kilolib is given (-DKILOLIB=...); nothing of it is in this repository.
//
// kilolib calls back from interrupts. Nothing but copying is done there: node and program run in
// kilolib's loop only, and the message to send next is prepared there.
#pragma once

#include <avr/interrupt.h>
#include <stdint.h>
#include <util/atomic.h>

extern "C" {
#include <kilolib.h>
}

#include "kilobot_wire/ir_message.hpp"
#include "platforms/robot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk {
namespace kilobot {

class KilolibRobot {
 public:
  using Profile = core::Kilobot;
  using Distance = Profile::Sensing::Distance;
  static constexpr uint16_t kBodyMm = 33;
  static constexpr uint32_t kTicksPerSecond = 31;

  KilolibRobot() : node_(core::Port{&port_clock, &port_random, nullptr}) {}
  KilolibRobot(const KilolibRobot&) = delete;
  KilolibRobot& operator=(const KilolibRobot&) = delete;

  core::Swarmtalk<Profile>& swarmtalk() { return node_; }
  uint32_t clock() { return port_clock(nullptr); }
  uint32_t random() { return port_random(nullptr); }
  static Distance distance(int32_t mm) { return static_cast<Distance>(mm); }

  void led(platforms::Colour colour) {
    set_color(RGB(colour.red >> 6, colour.green >> 6, colour.blue >> 6));
  }
  void forward(uint32_t duration_ticks) {
    move(kilo_straight_left, kilo_straight_right, duration_ticks);
  }
  void left(uint32_t duration_ticks) { move(kilo_turn_left, 0, duration_ticks); }
  void right(uint32_t duration_ticks) { move(0, kilo_turn_right, duration_ticks); }
  void stop() {
    is_moving_ = false;
    set_motors(0, 0);
  }
  bool is_moving() { return is_moving_; }
  void log(const char*, int32_t) {}

  /// One pass of kilolib's loop, before the program's: what was received, what is to be sent.
  void poll() {
    if (is_moving_ && has_end_ && static_cast<int32_t>(clock() - end_tick_) >= 0) stop();
    for (uint8_t i = 0; i < kSlots; ++i) receive(slots_[i]);
    if (!is_message_ready_ && node_.pull_packet(message_.data) != 0) {
      message_.type = kIrSwarmtalk;
      message_.crc = message_crc(&message_);
      is_message_ready_ = true;
    }
  }

  /// kilo_message_rx: from the interrupt. A message that finds no place is lost, as on the air.
  void on_message(const message_t& message, const distance_measurement_t& measurement) {
    if (!is_swarmtalk(message.type) && message.type != kIrSwarmtalkFromOverhead) return;
    for (uint8_t i = 0; i < kSlots; ++i) {
      if (slots_[i].is_full) continue;
      slots_[i] = Slot{message, measurement, true};
      return;
    }
  }
  /// kilo_message_tx and kilo_message_tx_success: from the interrupt.
  message_t* message_to_send() { return is_message_ready_ ? &message_ : nullptr; }
  void on_sent() { is_message_ready_ = false; }

 private:
  static constexpr uint8_t kSlots = 3;
  struct Slot {
    message_t message;
    distance_measurement_t measurement;
    volatile bool is_full;
  };

  static uint32_t port_clock(void*) {
    uint32_t ticks;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
      ticks = kilo_ticks;
    }
    return ticks;
  }
  static uint32_t port_random(void*) {
    uint32_t bits = 0;
    for (uint8_t i = 0; i < 4; ++i) bits = (bits << 8) | rand_hard();
    return bits;
  }

  /// The interrupt leaves a full slot alone, so it can be read with interrupts on.
  void receive(Slot& slot) {
    if (!slot.is_full) return;
    const bool is_robot = is_swarmtalk(slot.message.type);
    const Distance mm = is_robot ? estimate_distance(&slot.measurement) : Distance{-1};
    node_.on_packet(slot.message.data, kIrDataBytes, {mm});
    slot.is_full = false;
  }

  void move(uint8_t left_duty, uint8_t right_duty, uint32_t duration_ticks) {
    if (!is_moving_) spinup_motors();
    set_motors(left_duty, right_duty);
    is_moving_ = true;
    has_end_ = duration_ticks != 0;
    end_tick_ = clock() + duration_ticks;
  }

  core::Swarmtalk<Profile> node_;
  message_t message_;
  Slot slots_[kSlots] = {};
  uint32_t end_tick_ = 0;
  volatile bool is_message_ready_ = false;
  bool is_moving_ = false;
  bool has_end_ = false;
};

/// Joins a program with KilolibRobot; one per image, as join.hpp does it on our own layer.
template <template <class> class ProgramTemplate>
class JoinedOnKilolib {
 public:
  template <class... Arguments>
  explicit JoinedOnKilolib(Arguments... arguments) : program_(robot_, arguments...) {
    instance_ = this;
  }

  /// Behind kilo_init(). Never returns.
  void run() {
    kilo_message_rx = [](message_t* message, distance_measurement_t* measurement) {
      instance_->robot_.on_message(*message, *measurement);
    };
    kilo_message_tx = [] { return instance_->robot_.message_to_send(); };
    kilo_message_tx_success = [] { instance_->robot_.on_sent(); };
    kilo_start([] { instance_->program_.setup(); },
               [] {
                 instance_->robot_.poll();
                 instance_->program_.loop();
               });
  }

 private:
  static JoinedOnKilolib* instance_;
  KilolibRobot robot_;
  ProgramTemplate<KilolibRobot> program_;
};

template <template <class> class ProgramTemplate>
JoinedOnKilolib<ProgramTemplate>* JoinedOnKilolib<ProgramTemplate>::instance_ = nullptr;

}  // namespace kilobot
}  // namespace swarmtalk
