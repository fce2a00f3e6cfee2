// Always has something to say, at the shortest spacing, and remembers what it heard: for
// measurements of the air. Its counters are read by name from an emulated robot's memory.
// Message type 0x10: data[0..1] uid, data[2..3] number of the message, both little-endian.
#include "platforms/kilobot/kilobot_robot.hpp"
#include "platforms/kilobot/runtime.hpp"

namespace {

using namespace swarmtalk::kilobot;

constexpr uint8_t kBeaconType = 0x10;

}  // namespace

// What an emulator looks at; all wrap.
volatile uint16_t beacon_asked;  // messages handed over to be sent
volatile uint16_t beacon_heard;
volatile int16_t beacon_distance_mm;  // of the last message heard
volatile uint16_t beacon_last_uid;    // its sender

namespace {

void setup() {}
void loop() {}

void receive(const IrReception& reception) {
  if (reception.message.type != kBeaconType) return;
  beacon_heard = static_cast<uint16_t>(beacon_heard + 1);
  beacon_distance_mm = distance_mm(reception);
  const uint8_t* data = reception.message.data;
  beacon_last_uid = static_cast<uint16_t>(data[0] | (static_cast<uint16_t>(data[1]) << 8));
}

bool next(IrMessage& out) {
  const uint16_t uid = control().uid();
  const uint16_t number = beacon_asked;
  beacon_asked = static_cast<uint16_t>(number + 1);
  out = {{static_cast<uint8_t>(uid), static_cast<uint8_t>(uid >> 8), static_cast<uint8_t>(number),
          static_cast<uint8_t>(number >> 8)},
         kBeaconType};
  return true;
}

}  // namespace

int main() {
  run_program({&setup, &loop, &receive, &next});
}
