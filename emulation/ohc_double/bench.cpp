#include "emulation/ohc_double/bench.hpp"

#include <algorithm>

#include "hex/digits.hpp"

namespace swarmtalk::ohc_double {
namespace {

std::uint64_t to_us(std::uint64_t time_ns) {
  return time_ns / 1000;
}

}  // namespace

Bench::Bench(const Settings& settings, std::function<void(const Json&)> report)
    : report_(std::move(report)), ohc_(settings.boot_ns) {
  for (unsigned i = 0; i < settings.robots; ++i)
    robots_.emplace_back(static_cast<std::uint16_t>(i + 1), settings.loss, settings.seed);
  for (const KilobotDouble& robot : robots_) reported_.push_back(robot.state());
  ohc_.on_frame = [this](std::uint64_t time_ns, const FoundFrame& found) {
    report_({{"time_us", to_us(time_ns)},
             {"event", "frame"},
             {"type", found.frame[1]},
             {"false", found.is_false}});
  };
  ohc_.on_transmission = [this](const Transmission& transmission) {
    report_({{"time_us", to_us(transmission.start_ns)},
             {"event", "infrared"},
             {"hex", hex::to_hex(transmission.message)},
             {"damaged", transmission.is_damaged}});
    if (transmission.is_damaged) return;
    for (std::size_t i = 0; i < robots_.size(); ++i) {
      robots_[i].hear(transmission.message, transmission.start_ns);
      report_robot(i, transmission.start_ns);
    }
  };
}

void Bench::report_robot(std::size_t robot, std::uint64_t time_ns) {
  const KilobotDouble::State state = robots_[robot].state();
  if (state == reported_[robot]) return;
  reported_[robot] = state;
  report_({{"time_us", to_us(time_ns)},
           {"event", "robot"},
           {"robot", robot},
           {"state", to_text(state)}});
}

void Bench::put(std::uint8_t byte, std::uint64_t time_ns) {
  now_ns_ = std::max(now_ns_, time_ns);
  ohc_.put(byte, now_ns_);
}

void Bench::send(std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) put(byte, now_ns_ + kByteNs);
}

void Bench::wait_until(std::uint64_t time_ns) {
  now_ns_ = std::max(now_ns_, time_ns);
  ohc_.advance(now_ns_);
}

Bench::Json Bench::state() const {
  const OhcDouble::Counters& counters = ohc_.counters();
  Json robots = Json::array();
  for (const KilobotDouble& robot : robots_)
    robots.push_back({{"state", to_text(robot.state())},
                      {"uid", robot.values().uid},
                      {"eeprom_uid", robot.eeprom().uid},
                      {"led", robot.led()},
                      {"motors_enabled", robot.has_motors_enabled()},
                      {"motor_left", robot.motors().left},
                      {"motor_right", robot.motors().right},
                      {"starts", robot.starts()},
                      {"pages_done", robot.pages_done()},
                      {"bootloader_damaged", robot.has_damaged_bootloader()}});
  return {{"time_us", to_us(now_ns_)},
          {"event", "state"},
          {"frames", counters.frames},
          {"false_frames", counters.false_frames},
          {"dangerous_frames", counters.dangerous_frames},
          {"replaced_frames", counters.replaced_frames},
          {"lost_bytes", counters.lost_bytes},
          {"good", counters.good},
          {"damaged", counters.damaged},
          {"led", ohc_.is_led_on()},
          {"repeating", ohc_.is_repeating()},
          {"robots", robots}};
}

}  // namespace swarmtalk::ohc_double
