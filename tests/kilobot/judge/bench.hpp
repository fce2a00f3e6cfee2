// Bench: one robot's image on an emulated processor with nothing around it: messages go in as
// light, and what is seen at the pins comes out. It reads pins and registers by itself and not by
// the emulator's body model, which is judged with it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "emulation/kilobot/eeprom.hpp"
#include "emulation/kilobot/image.hpp"
#include "emulation/kilobot/mcu.hpp"
#include "emulation/kilobot/robot_body.hpp"
#include "tests/kilobot/judge/probe.hpp"

namespace swarmtalk::judge {

/// What the motors' pins do: duty of PB3 and PD3, 0 while a pin does not drive.
struct MotorPins {
  std::uint8_t pb3 = 0, pd3 = 0;
  bool operator==(const MotorPins&) const = default;
};

/// Levels of the LED, 0 to 3: for each colour the weak resistor counts one, the strong one two.
struct Led {
  std::uint8_t red = 0, green = 0, blue = 0;
  bool operator==(const Led&) const = default;
  auto operator<=>(const Led&) const = default;
};

/// A value and how long it lasted. Shorter than a period of the motors' PWM is not seen.
template <class Value>
struct Stretch {
  Value value;
  double ms = 0;
};

struct Seen {
  std::vector<Stretch<MotorPins>> motors;
  std::vector<Stretch<Led>> led;
};

/// A register that is compared.
struct Register {
  const char* name;
  std::uint16_t address;
  std::uint8_t mask;  // bits that are of interest: no counters, no flags
};
const std::vector<Register>& registers();

class Bench {
 public:
  static constexpr std::uint32_t kCyclesPerMs = 8000;

  /// @throws std::runtime_error if the image cannot be read
  Bench(const std::string& image, const emulator::Eeprom& eeprom,
        std::uint16_t battery_counts = 700);

  /// Lets a message reach the robot and time pass, and watches.
  Seen send(std::uint8_t type, const std::vector<std::uint8_t>& data, double ms = kSettleMs);
  /// The same of a robot that a call is for. @return what it answered
  std::uint16_t call(Call call, const std::vector<std::uint8_t>& arguments = {},
                     double ms = kCallMs);
  Seen watch(double ms);
  /// What was seen during the last send(), call() or watch().
  const Seen& seen() const { return seen_; }

  /// Converter channels and clocks that single readings used: ADMUX and the low bits of ADCSRA.
  std::vector<std::array<std::uint8_t, 2>> readings_of(Call call);
  /// Pins of port B that gave light while a message was sent.
  std::uint8_t transmitting_pins();

  std::uint8_t reg(const Register& which) const;
  std::uint32_t variable(const std::string& name, unsigned offset = 0, unsigned bytes = 2) const;
  MotorPins motors() const;
  Led led() const;
  emulator::Mcu& mcu() { return *mcu_; }
  emulator::Eeprom eeprom() const { return mcu_->eeprom(); }

  static constexpr double kSettleMs =
      500;  // longer than two flashes, in which kilolib sees nothing
  static constexpr double kCallMs = 40;

 private:
  void shine(std::uint8_t type, const std::vector<std::uint8_t>& data, unsigned copies);
  void look(double ms);

  emulator::Image image_;
  std::unique_ptr<emulator::Mcu> mcu_;
  Seen seen_;
};

/// A calibrated robot, unlike any other: uid 1234, four different duties.
emulator::Eeprom calibrated();

}  // namespace swarmtalk::judge
