#include "tests/kilobot/judge/bench.hpp"

#include <algorithm>

#include "emulation/kilobot/atmega328p.hpp"
#include "emulation/kilobot/ir_frame.hpp"

namespace swarmtalk::judge {

namespace at = emulator::atmega328p;

namespace {

constexpr std::uint32_t kLookCycles = 400;  // 50 us
constexpr double kShortestMs = 0.6;         // more than a period of the motors' PWM
constexpr std::uint32_t kPulseCycles = 9;
constexpr double kSignalMm = 50;
// As an overhead controller repeats them: kilolib misses a message whose bits meet its clock's
// interrupt.
constexpr unsigned kCopies = 3;
constexpr std::uint64_t kCopyCycles = 83'200;
constexpr int kTries = 4;
constexpr unsigned kMotorPin = 3;             // of port B and of port D
constexpr std::uint8_t kInfraredPins = 0xC7;  // that may carry LEDs

std::uint8_t level(std::uint8_t outputs, unsigned weak, unsigned strong) {
  return static_cast<std::uint8_t>(((outputs >> weak) & 1) + 2 * ((outputs >> strong) & 1));
}

template <class Value>
void add(std::vector<Stretch<Value>>& stretches, const Value& value, double ms) {
  if (stretches.empty() || stretches.back().value != value) stretches.push_back({value, 0});
  stretches.back().ms += ms;
}

/// Without what is too short for a motor or an eye; neighbours that are equal then become one.
template <class Value>
std::vector<Stretch<Value>> cleaned(const std::vector<Stretch<Value>>& stretches) {
  std::vector<Stretch<Value>> result;
  for (const Stretch<Value>& stretch : stretches)
    if (stretch.ms >= kShortestMs) add(result, stretch.value, stretch.ms);
  return result;
}

}  // namespace

const std::vector<Register>& registers() {
  static const std::vector<Register> all = {
      {"DDRB", 0x24, 0xFF},   {"PORTB", 0x25, 0xFF},  {"DDRC", 0x27, 0xC3},
      {"PORTC", 0x28, 0xFF},  {"DDRD", 0x2A, 0xCF},   {"PORTD", 0x2B, 0xFF},
      {"TCCR0A", 0x44, 0xFF}, {"TCCR0B", 0x45, 0xFF}, {"TIMSK0", 0x6E, 0xFF},
      {"TCCR1A", 0x80, 0xFF}, {"TCCR1B", 0x81, 0xFF}, {"TIMSK1", 0x6F, 0xFF},
      {"TCCR2A", 0xB0, 0xFF}, {"TCCR2B", 0xB1, 0xFF}, {"OCR2A", 0xB3, 0xFF},
      {"OCR2B", 0xB4, 0xFF},  {"TIMSK2", 0x70, 0xFF}, {"ACSR", 0x50, 0xCF},
      {"ADMUX", 0x7C, 0xFF},  {"ADCSRA", 0x7A, 0xAF}, {"ADCSRB", 0x7B, 0xFF},
      {"DIDR1", 0x7F, 0xFF},  {"OSCCAL", 0x66, 0xFF}, {"UCSR0B", 0xC1, 0xFF},
      {"WDTCSR", 0x60, 0x7F}, {"MCUCR", 0x55, 0xFF},
  };
  return all;
}

emulator::Eeprom calibrated() {
  emulator::Calibration calibration;
  calibration.uid = 1234;
  calibration.turn_left = 71;
  calibration.turn_right = 62;
  calibration.straight_left = 60;
  calibration.straight_right = 66;
  return emulator::make_eeprom(calibration);
}

Bench::Bench(const std::string& image, const emulator::Eeprom& eeprom, std::uint16_t battery_counts)
    : image_(emulator::load_image(image)) {
  emulator::McuSettings settings;
  settings.analog.battery_counts = battery_counts;
  mcu_ = std::make_unique<emulator::Mcu>(image_, eeprom, settings);
  watch(400);
}

void Bench::shine(std::uint8_t type, const std::vector<std::uint8_t>& data, unsigned copies) {
  const emulator::SignalStrength strength = emulator::signal_at(kSignalMm);
  const std::vector<std::uint64_t> pulses_ns =
      emulator::ir_pulses(emulator::make_ir_message(data, type));
  std::uint64_t start = mcu_->cycle() + kCyclesPerMs;
  for (unsigned copy = 0; copy < copies; ++copy) {
    for (const std::uint64_t pulse_ns : pulses_ns) {
      const std::uint64_t cycle = start + pulse_ns * kCyclesPerMs / 1'000'000;
      mcu_->push_light({cycle, strength, true});
      mcu_->push_light({cycle + kPulseCycles, strength, false});
    }
    start += kCopyCycles;
  }
}

void Bench::look(double ms) {
  const std::uint64_t end =
      mcu_->cycle() + static_cast<std::uint64_t>(ms * static_cast<double>(kCyclesPerMs));
  while (mcu_->cycle() < end) {
    const std::uint64_t before = mcu_->cycle();
    mcu_->run_until(before + kLookCycles);
    const double step_ms =
        static_cast<double>(mcu_->cycle() - before) / static_cast<double>(kCyclesPerMs);
    add(seen_.motors, motors(), step_ms);
    add(seen_.led, led(), step_ms);
  }
  seen_.motors = cleaned(seen_.motors);
  seen_.led = cleaned(seen_.led);
}

Seen Bench::watch(double ms) {
  seen_ = {};
  look(ms);
  return seen_;
}

Seen Bench::send(std::uint8_t type, const std::vector<std::uint8_t>& data, double ms) {
  shine(type, data, kCopies);
  return watch(ms);
}

std::uint16_t Bench::call(Call call, const std::vector<std::uint8_t>& arguments, double ms) {
  std::vector<std::uint8_t> data{static_cast<std::uint8_t>(call)};
  data.insert(data.end(), arguments.begin(), arguments.end());
  const std::uint32_t done = variable("probe_done", 0, 1);
  for (int i = 0; i < kTries; ++i) {
    shine(kCallType, data, 1);
    watch(ms);
    if (variable("probe_done", 0, 1) == ((done + 1) & 0xFF))
      return static_cast<std::uint16_t>(variable("probe_answer"));
  }
  throw std::runtime_error("the robot has not done what it was told; it does not run?");
}

std::vector<std::array<std::uint8_t, 2>> Bench::readings_of(Call call) {
  constexpr std::uint8_t kStarted = 1 << 6, kDividerMask = 7;
  shine(kCallType, {static_cast<std::uint8_t>(call)}, 1);
  std::vector<std::array<std::uint8_t, 2>> found;
  const std::uint64_t end = mcu_->cycle() + 30 * kCyclesPerMs;
  while (mcu_->cycle() < end) {
    mcu_->run_until(mcu_->cycle() + 4);
    const std::uint8_t control = mcu_->data(at::kAdcsra);
    const bool is_single = (control & kStarted) != 0 && (control & at::kAdate) == 0;
    const std::array<std::uint8_t, 2> reading{mcu_->data(0x7C),
                                              static_cast<std::uint8_t>(control & kDividerMask)};
    if (is_single && (found.empty() || found.back() != reading)) found.push_back(reading);
  }
  return found;
}

std::uint8_t Bench::transmitting_pins() {
  constexpr std::uint8_t kUserType = 0x12;
  shine(kCallType, {static_cast<std::uint8_t>(Call::kSend), kUserType}, 1);
  std::uint8_t lit = 0;
  const std::uint64_t end = mcu_->cycle() + 700 * kCyclesPerMs;  // kilolib sends twice a second
  while (mcu_->cycle() < end) {
    mcu_->run_until(mcu_->cycle() + 4);
    lit = static_cast<std::uint8_t>(lit | (mcu_->data(at::kDdrB) & mcu_->data(at::kPortB)));
  }
  return lit & kInfraredPins;
}

std::uint8_t Bench::reg(const Register& which) const {
  return mcu_->data(which.address) & which.mask;
}

std::uint32_t Bench::variable(const std::string& name, unsigned offset, unsigned bytes) const {
  const emulator::Symbol symbol = image_.symbols.at(name);
  std::uint32_t value = 0;
  for (unsigned i = bytes; i-- > 0;)
    value = value << 8 | mcu_->data(static_cast<std::uint16_t>(symbol.address + offset + i));
  return value;
}

MotorPins Bench::motors() const {
  const auto duty = [this](std::uint16_t direction, std::uint16_t port, std::uint8_t connected,
                           std::uint16_t compare) -> std::uint8_t {
    if (((mcu_->data(direction) >> kMotorPin) & 1) == 0) return 0;
    const bool is_pwm = (mcu_->data(at::kTccr2a) & connected) != 0 &&
                        (mcu_->data(at::kTccr2b) & at::kClock2Mask) != 0;
    if (is_pwm) return mcu_->data(compare);
    return ((mcu_->data(port) >> kMotorPin) & 1) != 0 ? std::uint8_t{255} : std::uint8_t{0};
  };
  return {duty(at::kDdrB, at::kPortB, at::kCom2a1, at::kOcr2a),
          duty(at::kDdrD, at::kPortD, at::kCom2b1, at::kOcr2b)};
}

Led Bench::led() const {
  const std::uint8_t c = mcu_->data(at::kDdrC), d = mcu_->data(at::kDdrD);
  return {level(d, 5, 4), level(c, 3, 2), level(c, 5, 4)};
}

}  // namespace swarmtalk::judge
