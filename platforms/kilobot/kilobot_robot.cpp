#include "platforms/kilobot/kilobot_robot.hpp"

namespace swarmtalk {
namespace kilobot {

int16_t distance_mm(const IrReception& reception) {
  if (reception.message.type == kIrSwarmtalkFromOverhead) return kDistanceUnknown;
  return distance_mm(reception.high_gain, reception.low_gain, kEepromHighGain, kEepromLowGain,
                     read_gain);
}

}  // namespace kilobot
}  // namespace swarmtalk
