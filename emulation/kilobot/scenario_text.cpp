// The short notations of scenarios: pins, serial commands, lamp messages, grids.
#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <stdexcept>

#include "emulation/kilobot/scenario.hpp"
#include "kilobot_wire/ohc_frame.hpp"

namespace swarmtalk::emulator {
namespace {

const std::map<std::string, std::uint8_t, std::less<>> kIrTypes = {
    {"boot", ohc_double::kIrBoot},     {"reset", ohc_double::kIrReset},
    {"sleep", ohc_double::kIrSleep},   {"wakeup", ohc_double::kIrWakeUp},
    {"charge", ohc_double::kIrCharge}, {"voltage", ohc_double::kIrVoltage},
    {"run", ohc_double::kIrRun}};

[[noreturn]] void fail(const std::string& text, const std::string& what) {
  throw std::runtime_error("\"" + text + "\": " + what);
}

double parse_number(const std::string& text, const std::string& number) {
  try {
    std::size_t used = 0;
    const double value = std::stod(number, &used);
    if (used == number.size() && value >= 0) return value;
  } catch (const std::logic_error&) {
  }
  fail(text, "\"" + number + "\" is not a number of at least 0");
}

std::vector<std::uint8_t> parse_hex(const std::string& text, std::string digits) {
  std::erase_if(digits, [](unsigned char c) { return std::isspace(c) != 0; });
  const bool is_hex = std::all_of(digits.begin(), digits.end(),
                                  [](unsigned char c) { return std::isxdigit(c) != 0; });
  if (!is_hex || digits.size() % 2 != 0) fail(text, "bytes must be pairs of hex digits");
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16)));
  return bytes;
}

/// Splits "WHAT@SECONDS" at its last @.
std::pair<std::string, std::string> split_time(const std::string& text) {
  const std::size_t at = text.rfind('@');
  if (at == std::string::npos) fail(text, "expected WHAT@SECONDS");
  return {text.substr(0, at), text.substr(at + 1)};
}

}  // namespace

Pin parse_pin(const std::string& text) {
  const bool is_good =
      text.size() == 2 && text[0] >= 'B' && text[0] <= 'D' && text[1] >= '0' && text[1] <= '7';
  if (!is_good) fail(text, "not a pin; expected B0 to D7");
  return {text[0], static_cast<std::uint8_t>(text[1] - '0')};
}

WatchSpec parse_watch(const std::string& text) {
  WatchSpec spec;
  const std::size_t sign = text.find_first_of("+-"), colon = text.find(':');
  spec.symbol = text.substr(0, std::min(sign, colon));
  if (sign != std::string::npos) {
    spec.is_from_end = text[sign] == '-';
    const std::size_t length = colon == std::string::npos ? colon : colon - sign - 1;
    spec.offset = static_cast<int>(parse_number(text, text.substr(sign + 1, length)));
  }
  if (colon != std::string::npos)
    spec.size_bytes = static_cast<unsigned>(parse_number(text, text.substr(colon + 1)));
  if (spec.size_bytes > 8) fail(text, "at most 8 bytes can be watched");
  return spec;
}

SerialSpec parse_serial(const std::string& text) {
  const auto [what, seconds] = split_time(text);
  SerialSpec serial;
  serial.at_s = parse_number(text, seconds);
  const auto use = [&](const ohc_double::Frame& frame) {
    serial.bytes.assign(frame.begin(), frame.end());
  };
  if (const auto ir = kIrTypes.find(what); ir != kIrTypes.end())
    use(ohc_double::make_message_frame(ohc_double::FrameType::kForward, ir->second));
  else if (what == "stop")
    use(ohc_double::make_frame(ohc_double::FrameType::kStop));
  else if (what == "led")
    use(ohc_double::make_frame(ohc_double::FrameType::kLedToggle));
  else if (what.starts_with("hex:"))
    serial.bytes = parse_hex(text, what.substr(4));
  else
    fail(text, "unknown command");
  return serial;
}

LampSpec parse_lamp(const std::string& text) {
  auto [what, time] = split_time(text);
  LampSpec lamp;
  if (const std::size_t x = time.find('x'); x != std::string::npos) {
    lamp.copies = static_cast<unsigned>(parse_number(text, time.substr(x + 1)));
    time.resize(x);
  }
  lamp.at_s = parse_number(text, time);
  std::vector<std::uint8_t> data;
  if (const std::size_t colon = what.find(':'); colon != std::string::npos) {
    data = parse_hex(text, what.substr(colon + 1));
    what.resize(colon);
  }
  if (data.size() > kIrPayloadBytes) fail(text, "more than 9 bytes of data");
  const auto ir = kIrTypes.find(what);
  unsigned long type = 256;
  try {
    type = ir != kIrTypes.end() ? ir->second : std::stoul(what, nullptr, 0);
  } catch (const std::logic_error&) {
  }
  if (type > 255) fail(text, "unknown message type");
  lamp.message = make_ir_message(data, static_cast<std::uint8_t>(type));
  return lamp;
}

void add_grid(Scenario& scenario, const std::string& size, double spacing_mm,
              const NodeSpec& each) {
  const std::size_t x = size.find('x');
  if (x == std::string::npos) fail(size, "expected ROWSxCOLUMNS");
  const auto rows = static_cast<unsigned>(parse_number(size, size.substr(0, x)));
  const auto columns = static_cast<unsigned>(parse_number(size, size.substr(x + 1)));
  if (rows * columns < 1 || rows * columns > 1000) fail(size, "1 to 1000 robots are possible");
  for (unsigned i = 0; i < rows * columns; ++i) {
    NodeSpec robot = each;
    robot.x_mm = (i % columns) * spacing_mm;
    robot.y_mm = static_cast<double>(i / columns) * spacing_mm;
    scenario.robots.push_back(std::move(robot));
  }
}

namespace {

void require(bool is_good, const char* what) {
  if (!is_good) throw std::runtime_error(what);
}

bool is_probability(double value) {
  return value >= 0 && value <= 1;
}

void check(const Scenario& scenario) {
  const MediumSettings& medium = scenario.medium;
  require(is_probability(medium.loss), "loss must be within 0 and 1");
  require(is_probability(medium.pulse_loss), "pulse_loss must be within 0 and 1");
  require(medium.range_mm >= 0, "range_mm must not be negative");
  require(medium.stray_pulses_per_s >= 0 && medium.stray_pulses_per_s <= 1e5,
          "stray_pulses_per_s must be within 0 and 100000");
  require(medium.delay_ns >= 1'000 && medium.delay_ns <= 100'000,
          "delay_ns must be within 1000 and 100000");
  require(scenario.sample_ms >= 0.01, "sample_ms must be at least 0.01");
  require(is_probability(scenario.motor_bias), "motor_bias must be within 0 and 1");
  require(is_probability(scenario.motor_noise), "motor_noise must be within 0 and 1");
  require(scenario.baud >= 300 && scenario.baud <= 1e6, "baud must be within 300 and 1000000");
  require(scenario.drift_ppm >= 0 && scenario.drift_ppm <= 500'000,
          "drift_ppm must be within 0 and 500000");
  require(scenario.power_on_spread_ms >= 0, "power_on_spread_ms must not be negative");
  require(scenario.real_time_factor >= 0, "real_time_factor must not be negative");
  require(scenario.seconds >= 0, "seconds must not be negative; 0 runs until Ctrl-C");
  for (const NodeSpec& robot : scenario.robots)
    require(robot.clock_hz >= 100'000 && robot.clock_hz <= 20'000'000,
            "clock_hz must be within 100000 and 20000000");
}

/// The log and the options tell nodes by name.
void require_distinct_names(const Scenario& scenario) {
  std::set<std::string> names;
  const auto add = [&](const NodeSpec& node) {
    if (!names.insert(node.name).second)
      throw std::runtime_error("two nodes are called \"" + node.name + "\"");
  };
  for (const NodeSpec& robot : scenario.robots) add(robot);
  if (scenario.ohc) add(*scenario.ohc);
}

}  // namespace

void complete(Scenario& scenario) {
  check(scenario);
  scenario.medium.seed = scenario.seed;
  Random chance(scenario.seed, 0);
  const auto fill = [&](NodeSpec& node) {
    const double drift =
        (2 * chance.unit() - 1) * scenario.drift_ppm;  // drawn in any case, so that
    const double power_on =
        chance.unit() * scenario.power_on_spread_ms;  // fixing one changes no other
    if (!node.drift_ppm) node.drift_ppm = drift;
    if (!node.power_on_ms) node.power_on_ms = power_on;
  };
  for (std::size_t i = 0; i < scenario.robots.size(); ++i) {
    NodeSpec& robot = scenario.robots[i];
    if (robot.name.empty()) robot.name = "k" + std::to_string(i);
    if (!robot.uid) robot.uid = static_cast<std::uint16_t>(i + 1);
    fill(robot);
  }
  if (scenario.ohc) {
    if (scenario.ohc->name.empty()) scenario.ohc->name = "ohc";
    if (!scenario.ohc->drift_ppm) scenario.ohc->drift_ppm = 0;
    if (!scenario.ohc->power_on_ms) scenario.ohc->power_on_ms = 0;
  }
  require_distinct_names(scenario);
}

}  // namespace swarmtalk::emulator
