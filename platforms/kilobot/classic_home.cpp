// Home of programs written for the SwarmTalk release of 2020 (core/classic/swarmtalk.h): link this
// with a program that includes "swarmtalk.h" and defines setup() and loop(), with platforms/classic
// in the include path and the program's macros (PKT_SIZE, TOTAL_CHAN_NUM, ...) given to both.
#include "platforms/kilobot/board.hpp"
#include "platforms/kilobot/clock.hpp"
#include "platforms/kilobot/kilobot_robot.hpp"
#include "platforms/kilobot/random.hpp"
#include "platforms/kilobot/runtime.hpp"

// "swarmtalk" is the program's object from the next header on; the program defines it.
namespace kilobot = swarmtalk::kilobot;

#define SWARMTALK_CLASSIC_NO_GLOBALS
#include "core/classic/swarmtalk.h"

namespace {

unsigned int read_clock() {
  return static_cast<unsigned int>(kilobot::ticks());
}
unsigned int draw() {
  return kilobot::random16();
}

/// Programs of 2020 give colours as 0 to 1 or as 0 to 255; the LED has 0 to 3.
uint8_t led_level(int value) {
  if (value <= 1) return value > 0 ? 1 : 0;
  return value < 64 ? uint8_t{1} : static_cast<uint8_t>(value >> 6);
}

void show(int red, int green, int blue) {
  kilobot::set_led(kilobot::led_rgb(led_level(red), led_level(green), led_level(blue)));
}

/// The program's own timer ends the move.
void move(int status) {
  const kilobot::MotorCalibration& speed = kilobot::control().motors();
  kilobot::Motion& motion = kilobot::control().motion();
  if (status == SwarmTalk::Move_forward) {
    motion.start(speed.straight_left, speed.straight_right, 0);
  } else if (status == SwarmTalk::Turn_left) {
    motion.start(speed.turn_left, 0, 0);
  } else if (status == SwarmTalk::Turn_right) {
    motion.start(0, speed.turn_right, 0);
  } else {
    motion.stop();
  }
}

void start_program() {
  SwarmTalk::compare_macros_with_the_program();
  swarmtalk_instance.sys.set_common_sys_get_clock(&read_clock);
  swarmtalk_instance.sys.set_common_sys_random_func(&draw);
  swarmtalk_instance.led.set_driver(&show, &read_clock);
  swarmtalk_instance.motor.set_driver(&move, &read_clock);
  swarmtalk_instance.register_user_loop(&loop);
  setup();
}

void run_loop() {
  swarmtalk_instance.execute_loop();
}

void receive(const kilobot::IrReception& reception) {
  if (reception.message.type != kilobot::kIrClassic2020) return;
  uint8_t packet[PKT_SIZE];
  for (uint8_t i = 0; i < PKT_SIZE; ++i) packet[i] = reception.message.data[i];
  Meta_t meta = {};
  meta.dist = kilobot::distance_mm(reception);
  swarmtalk_instance.receive(packet, PKT_SIZE, &meta);
}

bool next(kilobot::IrMessage& out) {
  static_assert(PKT_SIZE <= kilobot::kIrDataBytes,
                "PKT_SIZE: a packet fits an infrared message of 9 bytes");
  out = {};
  if (swarmtalk_instance.next_pkt(out.data) == 0) return false;
  out.type = kilobot::kIrClassic2020;
  return true;
}

}  // namespace

int main() {
  kilobot::run_program({&start_program, &run_loop, &receive, &next});
}
