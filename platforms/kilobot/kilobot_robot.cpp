#include "platforms/kilobot/kilobot_robot.hpp"

namespace swarmtalk {
namespace kilobot {

int16_t distance_mm(const IrReception& reception) {
  if (reception.message.type == kIrSwarmtalkFromOverhead) return kDistanceUnknown;
  return distance_mm(
      reception.high_gain, reception.low_gain,
      [](uint8_t entry) { return read_gain(kEepromHighGain, entry); },
      [](uint8_t entry) { return read_gain(kEepromLowGain, entry); });
}

}  // namespace kilobot
}  // namespace swarmtalk
