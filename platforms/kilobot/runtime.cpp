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
Backoff backoff;
uint8_t heard_at_last_send;
IrMessage message;  // waits for free air if has_message
bool has_message;

/// The time of a message differs from robot to robot by more than its lowest bits.
void receive_all(const Program& program) {
  while (const IrReception* reception = next_reception()) {
    stir_random(static_cast<uint8_t>(units()));
    if (reception->message.type >= kIrFirstControl) {
      robot_control.handle(reception->message);
    } else {
      program.receive(*reception);
    }
    drop_reception();
  }
}

/// Tries to send when its time has come. A message that met taken air waits for the next try.
void send(const Program& program) {
  if (!backoff.is_due(units())) return;
  const bool is_running = robot_control.state() == State::kRunning;
  if (is_running && !is_receiving() && !has_message) has_message = program.next(message);
  if (is_running && has_message && send_ir(message)) {
    has_message = false;
    const uint8_t heard = receptions_heard();
    backoff.on_sent(units(), static_cast<uint8_t>(heard - heard_at_last_send), random16());
    heard_at_last_send = heard;
    return;
  }
  // A robot with nothing to say keeps drawing, too, so that all that answer one message at once do
  // not answer at the same moment; and one that does not run, since a time that is long past counts
  // as one to come.
  backoff.on_deferred(units(), random16());
}

void run_state(const Program& program) {
  if (robot_control.state() == State::kSetup) {
    program.setup();
    robot_control.on_set_up();
  }
  if (robot_control.state() == State::kRunning) program.loop();
  send(program);
}

}  // namespace

Control& control() {
  return robot_control;
}

void run_program(const Program& program, uint16_t spacing) {
  start_board();
  start_clock();
  sei();
  seed_random();
  robot_control.start();
  start_sender();
  start_receiver();
  start_guard();
  backoff.start(units(), spacing, random16());
  uint16_t next_pass = units();
  for (;;) {
    const bool sends_first =
        robot_control.state() == State::kRunning && has_come(next_pass, backoff.due());
    sleep_until(sends_first ? backoff.due() : next_pass);
    const uint16_t pass = robot_control.motion().is_pushing() ? kPushUnits : kPassUnits;
    next_pass = static_cast<uint16_t>(units() + pass);
    feed_guard();
    receive_all(program);
    robot_control.poll();
    run_state(program);
  }
}

}  // namespace kilobot
}  // namespace swarmtalk
