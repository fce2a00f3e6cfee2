// probe.hpp on kilolib, written as its users write programs: a move begins with full power for
// 15 ms. kilolib calls back from interrupts, so a call is only kept there and done in its loop.
#include "tests/kilobot/judge/probe.hpp"

extern "C" {
#include <kilolib.h>
}

volatile uint8_t probe_done;
volatile uint16_t probe_answer;
volatile uint16_t probe_high;
volatile uint16_t probe_low;

namespace {

using swarmtalk::judge::Call;

volatile bool is_waiting;
uint8_t waiting[9];
message_t message;
volatile bool has_message;

uint16_t word(const uint8_t* bytes) {
  return static_cast<uint16_t>(bytes[0] | (static_cast<uint16_t>(bytes[1]) << 8));
}

void move(uint8_t left, uint8_t right) {
  set_motors(left != 0 ? 255 : 0, right != 0 ? 255 : 0);
  delay(15);
  set_motors(left, right);
}

uint16_t act(Call call, const uint8_t* data) {
  switch (call) {
    case Call::kSetMotors:
      set_motors(data[0], data[1]);
      break;
    case Call::kTurnLeft:
      move(kilo_turn_left, 0);
      break;
    case Call::kTurnRight:
      move(0, kilo_turn_right);
      break;
    case Call::kStraight:
      move(kilo_straight_left, kilo_straight_right);
      break;
    case Call::kStop:
      set_motors(0, 0);
      break;
    case Call::kSetColour:
      set_color(RGB(data[0], data[1], data[2]));
      break;
    case Call::kLight:
      return static_cast<uint16_t>(get_ambientlight());
    case Call::kBattery:
      return static_cast<uint16_t>(get_voltage());
    case Call::kTemperature:
      return static_cast<uint16_t>(get_temperature());
    case Call::kDistance: {
      distance_measurement_t measured;
      measured.high_gain = static_cast<int16_t>(word(data));
      measured.low_gain = static_cast<int16_t>(word(data + 2));
      return estimate_distance(&measured);
    }
    case Call::kUid:
      return kilo_uid;
    case Call::kTurnLeftDuty:
      return kilo_turn_left;
    case Call::kTurnRightDuty:
      return kilo_turn_right;
    case Call::kStraightLeft:
      return kilo_straight_left;
    case Call::kStraightRight:
      return kilo_straight_right;
    case Call::kTicks:
      return static_cast<uint16_t>(kilo_ticks);
    case Call::kSend:
      for (uint8_t i = 0; i < 9; ++i) message.data[i] = static_cast<uint8_t>(i + 1);
      message.type = data[0];
      message.crc = message_crc(&message);
      has_message = true;
      break;
    case Call::kNothing:
      break;
  }
  return 0;
}

void setup() {}
void loop() {
  if (!is_waiting) return;
  probe_answer = act(static_cast<Call>(waiting[0]), waiting + 1);
  is_waiting = false;
  probe_done = static_cast<uint8_t>(probe_done + 1);
}

void receive(message_t* heard, distance_measurement_t* measured) {
  probe_high = static_cast<uint16_t>(measured->high_gain);
  probe_low = static_cast<uint16_t>(measured->low_gain);
  if (heard->type != swarmtalk::judge::kCallType || is_waiting) return;
  for (uint8_t i = 0; i < 9; ++i) waiting[i] = heard->data[i];
  is_waiting = true;
}

message_t* next() {
  return has_message ? &message : nullptr;
}
void on_sent() {
  has_message = false;
}

}  // namespace

int main() {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = next;
  kilo_message_tx_success = on_sent;
  kilo_start(setup, loop);
}
