#include "platforms/kilobot/adc.hpp"

#include <avr/io.h>
#include <util/atomic.h>

#include "platforms/kilobot/ir_receiver.hpp"

namespace swarmtalk {
namespace kilobot {

int16_t read_adc(uint8_t channel) {
  int16_t reading = -1;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (!is_receiving()) {
      const uint8_t control = ADCSRA;
      ADMUX = channel;
      // No trigger: software starts it. Clock / 8, or / 128.
      ADCSRA = channel == kAdcTemperature ? (1 << ADEN) | (1 << ADPS2) | (1 << ADPS1) | (1 << ADPS0)
                                          : (1 << ADEN) | (1 << ADPS1) | (1 << ADPS0);
      ADCSRA |= 1 << ADSC;
      // A conversion takes 13 converter clocks, the first 25; the limit is for a broken converter.
      for (uint16_t i = 0; (ADCSRA & (1 << ADSC)) != 0 && i < 1000; ++i) {
      }
      reading = static_cast<int16_t>(ADC);
      ADMUX = kAdcHighGain;
      ADCSRA = control;
    }
  }
  return reading;
}

}  // namespace kilobot
}  // namespace swarmtalk
