#include "emulation/kilobot/emulation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "hex/digits.hpp"

namespace swarmtalk::emulator {
namespace {

constexpr std::uint64_t kLogFlushNs = 20'000'000;
constexpr std::uint64_t kTerminalPollNs = 250'000;  // about one byte on the line

std::uint64_t s_to_ns(double seconds) {
  return static_cast<std::uint64_t>(std::llround(seconds * 1e9));
}

Scenario completed(Scenario scenario) {
  complete(scenario);
  return scenario;
}

void add_bootloader(Image& program, const std::string& path) {
  const Image bootloader = load_image(path);
  try {
    program.add_bootloader(bootloader);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

}  // namespace

Emulation::Emulation(Scenario scenario, std::ostream* log_to)
    : scenario_(completed(std::move(scenario))),
      log_(log_to != nullptr ? "" : scenario_.log),
      medium_(scenario_.medium),
      scheduler_(scenario_.medium.delay_ns) {
  if (log_to != nullptr) log_.use(*log_to);
  if (scenario_.robots.empty() && !scenario_.ohc) throw std::runtime_error("no robots to emulate");
  for (const NodeSpec& robot : scenario_.robots) add_node(robot, nullptr);
  if (scenario_.ohc) add_node(*scenario_.ohc, &*scenario_.ohc);
  if (!scenario_.lamp.empty()) {
    lamp_ = std::make_unique<Lamp>(medium_, scenario_.lamp);
    station_names_.push_back("lamp");
    scheduler_.add(*lamp_);
  }
  if (scenario_.logs_air)
    medium_.on_message = [this](unsigned station, std::uint64_t time_ns, const IrMessage& message) {
      log_.write(time_ns, station_names_[station], "sent",
                 {{"type", message[9]},
                  {"data", hex::to_hex(std::span(message).first(kIrPayloadBytes))},
                  {"crc_ok", has_good_crc(message)}});
    };
  add_tasks();
}

std::shared_ptr<const Image> Emulation::load(const NodeSpec& spec) {
  if (spec.image.empty()) throw std::runtime_error(spec.name + " has no image");
  std::shared_ptr<const Image>& image = images_[{spec.image, spec.bootloader}];
  if (image == nullptr) {
    Image loaded = load_image(spec.image);
    if (!spec.bootloader.empty()) add_bootloader(loaded, spec.bootloader);
    image = std::make_shared<const Image>(std::move(loaded));
  }
  return image;
}

std::vector<std::string> Emulation::unknown_variables() const {
  std::vector<std::string> unknown;
  for (const std::string& text : scenario_.watch) {
    const std::string symbol = parse_watch(text).symbol;
    const bool is_known = std::any_of(images_.begin(), images_.end(), [&](const auto& image) {
      return image.second->symbols.contains(symbol);
    });
    if (!is_known) unknown.push_back(symbol);
  }
  return unknown;
}

void Emulation::add_node(const NodeSpec& spec, const OhcSpec* ohc) {
  const auto number = static_cast<unsigned>(nodes_.size());
  const Node::Context context{scenario_, medium_, log_};
  nodes_.push_back(std::make_unique<Node>(context, spec, ohc, load(spec), number));
  station_names_.push_back(spec.name);
  scheduler_.add(*nodes_.back());
  log_.write(0, spec.name, "start",
             {{"uid", spec.uid.value_or(0)},
              {"x_mm", spec.x_mm},
              {"y_mm", spec.y_mm},
              {"power_on_us", std::llround(spec.power_on_ms.value_or(0) * 1000)},
              {"drift_ppm", std::llround(spec.drift_ppm.value_or(0))}});
}

void Emulation::add_tasks() {
  if (scenario_.medium.stray_pulses_per_s > 0)
    scheduler_.every(scheduler_.quantum_ns(), [this](std::uint64_t time_ns) {
      medium_.advance(time_ns + scheduler_.quantum_ns());
    });
  scheduler_.every(s_to_ns(scenario_.sample_ms * 1e-3), [this](std::uint64_t time_ns) {
    for (const auto& node : nodes_) node->sample(time_ns);
  });
  bool has_terminal = false;
  for (const auto& node : nodes_) has_terminal = has_terminal || node->terminal() != nullptr;
  if (has_terminal)
    scheduler_.every(kTerminalPollNs, [this](std::uint64_t time_ns) {
      for (const auto& node : nodes_)
        if (scenario_.real_time_factor > 0)
          node->poll_terminal(time_ns, scheduler_.wall_ns(time_ns));
        else
          node->poll_terminal(time_ns);
    });
  // Somebody outside takes part and may want to read the log meanwhile.
  if (has_terminal || scenario_.real_time_factor > 0)
    scheduler_.every(kLogFlushNs, [this](std::uint64_t) { log_.flush(); });
  if (!scenario_.ohc_serial.empty()) {
    if (!scenario_.ohc)
      throw std::runtime_error("bytes for an overhead controller, but there is none");
    scheduler_.every(kTerminalPollNs, [this, next = std::size_t{0}](std::uint64_t time_ns) mutable {
      for (; next < scenario_.ohc_serial.size() &&
             s_to_ns(scenario_.ohc_serial[next].at_s) <= time_ns;
           ++next)
        nodes_.back()->queue_serial(scenario_.ohc_serial[next].bytes, time_ns);
    });
  }
  if (scenario_.real_time_factor > 0)
    scheduler_.pace(scenario_.real_time_factor, monotonic_clock());
}

void Emulation::run_until(double seconds) {
  scheduler_.run_until(s_to_ns(seconds));
}

void Emulation::run() {
  run_until(scenario_.seconds);
  for (const auto& node : nodes_) {
    node->sample(scheduler_.now_ns());
    node->finish(scheduler_.now_ns());
  }
  log_.flush();
}

const Node& Emulation::node(const std::string& name) const {
  for (const auto& node : nodes_)
    if (node->name() == name) return *node;
  throw std::runtime_error("no node is called " + name);
}

}  // namespace swarmtalk::emulator
