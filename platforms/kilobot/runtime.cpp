#include "platforms/kilobot/runtime.hpp"

#include <avr/interrupt.h>

#include "platforms/kilobot/board.hpp"
#include "platforms/kilobot/clock.hpp"
#include "platforms/kilobot/ir_sender.hpp"
#include "platforms/kilobot/random.hpp"
#include "platforms/kilobot/restart.hpp"

namespace swarmtalk {
namespace kilobot {

namespace {

constexpr uint16_t kPassUnits = 32;  // 4.1 ms between two passes of the main loop
constexpr uint16_t kPushUnits = 2;   // the same while a push of the motors has to end in time

Control robot_control;
Turns turns;
IrMessage message;  // waits for free air if has_message
bool has_message;

__attribute__((noinline)) void move() {
  turns.move(random16());
}

/// The time of a message differs from robot to robot by more than its lowest bits.
void receive_all(const Program& program) {
  if (take_garbled()) turns.on_garbled(units());
  while (const IrReception* reception = next_reception()) {
    const uint16_t now = units();
    stir_random(static_cast<uint8_t>(now));
    const uint8_t type = reception->message.type;
    if (type >= kIrFirstControl) {
      robot_control.handle(reception->message);
    } else {
      if (turns.on_heard(static_cast<uint16_t>(now - Turns::kMessageUnits), type)) move();
      program.receive(*reception);
    }
    drop_reception();
  }
}

/// Tries to send when its time has come. A message that met taken air waits for the next try.
void send(const Program& program, uint16_t period) {
  const uint16_t now = units();
  if (!turns.is_due(now)) return;
  if (robot_control.state() == State::kRunning) {
    if (is_receiving()) return move();
    if (!has_message) has_message = program.next(message);
    if (has_message && !send_ir(message)) return move();
    has_message = false;
  }
  // Also with nothing to say, or before RUN: a time that is long past would count as one to come.
  turns.on_turn(now, period);
}

void run_state(const Program& program) {
  if (robot_control.state() == State::kSetup) {
    program.setup();
    robot_control.on_set_up();
  }
  if (robot_control.state() == State::kRunning) program.loop();
}

}  // namespace

Control& control() {
  return robot_control;
}

uint8_t swarmtalk_type() {
  return turns.type(units());
}

void run_program(const Program& program, uint16_t period) {
  start_board();
  start_clock();
  sei();
  seed_random();
  robot_control.start();
  start_sender();
  start_receiver();
  start_guard();
  turns.start(units());
  move();
  uint16_t next_pass = units();
  for (;;) {
    const bool sends_first =
        robot_control.state() == State::kRunning && has_come(next_pass, turns.due());
    sleep_until(sends_first ? turns.due() : next_pass);
    const uint16_t pass = robot_control.motion().is_pushing() ? kPushUnits : kPassUnits;
    next_pass = static_cast<uint16_t>(units() + pass);
    feed_guard();
    send(program, period);  // first: turns begin in time
    receive_all(program);
    robot_control.poll();
    run_state(program);
  }
}

}  // namespace kilobot
}  // namespace swarmtalk
