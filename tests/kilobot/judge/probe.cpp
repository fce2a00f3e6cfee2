// probe.hpp on our hardware layer.
#include "tests/kilobot/judge/probe.hpp"

#include "platforms/kilobot/adc.hpp"
#include "platforms/kilobot/kilobot_robot.hpp"
#include "platforms/kilobot/runtime.hpp"

volatile uint8_t probe_done;
volatile uint16_t probe_answer;
volatile uint16_t probe_high;
volatile uint16_t probe_low;

namespace {

using namespace swarmtalk::kilobot;
using swarmtalk::judge::Call;

uint8_t type_to_send;  // 0: none

uint16_t word(const uint8_t* bytes) {
  return static_cast<uint16_t>(bytes[0] | (static_cast<uint16_t>(bytes[1]) << 8));
}

uint16_t act(Call call, const uint8_t* data) {
  Motion& motion = control().motion();
  const MotorCalibration& duties = control().motors();
  switch (call) {
    case Call::kSetMotors:
      set_motors(data[0], data[1]);
      break;
    case Call::kTurnLeft:
      motion.start(duties.turn_left, 0, 0);
      break;
    case Call::kTurnRight:
      motion.start(0, duties.turn_right, 0);
      break;
    case Call::kStraight:
      motion.start(duties.straight_left, duties.straight_right, 0);
      break;
    case Call::kStop:
      motion.stop();
      break;
    case Call::kSetColour:
      set_led(led_rgb(data[0], data[1], data[2]));
      break;
    case Call::kLight:
      return static_cast<uint16_t>(read_light());
    case Call::kBattery:
      return static_cast<uint16_t>(read_battery());
    case Call::kTemperature:
      return static_cast<uint16_t>(read_temperature());
    case Call::kDistance:
      return static_cast<uint16_t>(
          distance_mm(word(data), word(data + 2), kEepromHighGain, kEepromLowGain, read_gain));
    case Call::kUid:
      return control().uid();
    case Call::kTurnLeftDuty:
      return duties.turn_left;
    case Call::kTurnRightDuty:
      return duties.turn_right;
    case Call::kStraightLeft:
      return duties.straight_left;
    case Call::kStraightRight:
      return duties.straight_right;
    case Call::kTicks:
      return static_cast<uint16_t>(ticks());
    case Call::kSend:
      type_to_send = data[0];
      break;
    case Call::kNothing:
      break;
  }
  return 0;
}

void setup() {}
void loop() {}

void receive(const IrReception& reception) {
  probe_high = reception.high_gain;
  probe_low = reception.low_gain;
  if (reception.message.type != swarmtalk::judge::kCallType) return;
  const uint8_t* data = reception.message.data;
  probe_answer = act(static_cast<Call>(data[0]), data + 1);
  probe_done = static_cast<uint8_t>(probe_done + 1);
}

bool next(IrMessage& out) {
  if (type_to_send == 0) return false;
  out = {{1, 2, 3, 4, 5, 6, 7, 8, 9}, type_to_send};
  type_to_send = 0;
  return true;
}

}  // namespace

int main() {
  run_program({&setup, &loop, &receive, &next});
}
