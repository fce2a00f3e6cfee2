#include "platforms/kilobot/eeprom.hpp"

#include <avr/eeprom.h>

namespace swarmtalk {
namespace kilobot {

uint8_t read_eeprom(uint16_t address) {
  return eeprom_read_byte(reinterpret_cast<const uint8_t*>(address));
}

void write_eeprom(uint16_t address, uint8_t value) {
  eeprom_update_byte(reinterpret_cast<uint8_t*>(address), value);
}

}  // namespace kilobot
}  // namespace swarmtalk
