#include "emulation/kilobot/quiet_ports.hpp"

#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>

#include "emulation/kilobot/atmega328p.hpp"

namespace swarmtalk::emulator {

namespace reg = atmega328p;

QuietPorts::QuietPorts(avr_t* avr) {
  const std::array<std::uint16_t, 6> ports{reg::kDdrB,  reg::kDdrC,  reg::kDdrD,
                                           reg::kPortB, reg::kPortC, reg::kPortD};
  for (std::size_t i = 0; i < ports.size(); ++i) {
    auto& handler = avr->io[AVR_DATA_TO_IO(ports[i])].w;
    behind_[i] = {handler.c, handler.param};
    handler.c = on_write;
    handler.param = &behind_[i];
  }
}

void QuietPorts::on_write(avr_t* avr, std::uint16_t address, std::uint8_t value, void* behind) {
  const auto& next = *static_cast<const Behind*>(behind);
  if (avr->data[address] != value) next.write(avr, address, value, next.param);
}

}  // namespace swarmtalk::emulator
