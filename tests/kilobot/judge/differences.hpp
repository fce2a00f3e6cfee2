// What may differ between kilolib's image and ours: registers whose settings reach no motor, LED,
// distance or cell of EEPROM, each with the reason. Anything else fails judge_test.cpp, and so does
// an entry here that nothing needs any more.
#pragma once

#include <string_view>
#include <vector>

namespace swarmtalk::judge {

struct Difference {
  std::string_view name;  // of the register
  unsigned mask;          // bits that may differ
  std::string_view reason;
};

inline const std::vector<Difference>& listed_differences() {
  static const std::vector<Difference> list = {
      {"DDRB", 0xC7, "infrared pins stay outputs, low, between messages; kilolib lets them float"},
      {"PORTD", 0x01, "a pull-up at the charger's open-drain signal"},
      {"DDRD", 0x04, "in deep sleep the receiver's supply is held low; kilolib lets it float"},
      {"TIMSK1", 0x02, "the receiver's timer is off in deep sleep"},
      {"TIMSK0", 0xFF, "the clock counts overflows, and a second compare ends idle sleep"},
      {"TCCR2A", 0xFF,
       "the motors' timer stands while both duties are 0; the pins are low either way"},
      {"TCCR2B", 0xFF, "dito"},
      {"UCSR0B", 0x08, "simavr powers on with the transmitter enabled, and ours switches it off"},
      {"WDTCSR", 0xFF, "the watchdog restarts a program that hangs with interrupts off"},
      {"ADMUX", 0xFF, "kilolib leaves the converter at the battery when it shows the voltage"},
      {"ADCSRA", 0xFF, "dito, without the receiver's trigger; and in deep sleep ours is off"},
  };
  return list;
}

/// What is seen in kilolib and not repeated here; none of it is compared.
inline const std::vector<std::string_view>& defects_not_repeated() {
  static const std::vector<std::string_view> list = {
      "a calibration equal to the one before a pause does not move the robot",
      "a message that arrives while the voltage is shown turns the LED red; what is shown then may "
      "stay behind RUN, CALIB and READUID",
      "a stop that comes between two looks at the motion pushes both motors for 15 ms first",
      "an erased duty drives a motor at full power without end",
      "a distance of more than 222 mm between bodies wraps to a small one",
      "a robot without tables measures 123 mm or divides by zero; here it is unknown",
  };
  return list;
}

}  // namespace swarmtalk::judge
