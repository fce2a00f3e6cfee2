#include "platforms/kilobot/kilobot_robot.hpp"

namespace swarmtalk {
namespace kilobot {

int16_t distance_mm(const IrReception& reception) {
  if (reception.message.type == kIrSwarmtalkFromOverhead) return kDistanceUnknown;
  // One type for both tables: one copy of the code.
  struct Table {
    uint16_t address;
    uint16_t operator()(uint8_t entry) const { return read_gain(address, entry); }
  };
  return distance_mm(reception.high_gain, reception.low_gain, Table{kEepromHighGain},
                     Table{kEepromLowGain});
}

}  // namespace kilobot
}  // namespace swarmtalk
