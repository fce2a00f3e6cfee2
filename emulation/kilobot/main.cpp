// kilobot-emulator: N Kilobots and an overhead controller with their real firmware images, joined
// by infrared light at signal level. See docs/kilobot-emulator.md.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <exception>

#include "emulation/kilobot/emulation.hpp"
#include "usage/ending_signals.hpp"

namespace {

using namespace swarmtalk::emulator;

volatile std::sig_atomic_t g_stop = 0;

struct Options {
  std::string scenario, grid, image, bootloader, ohc, ohc_pin = "D3", pty;
  double spacing_mm = 50;
  std::vector<std::string> image_of, serial_pty, lamp, send;
  std::vector<std::string> dump_flash;
};

/// "NUMBER=PATH" for one robot; the number counts from 0.
std::pair<NodeSpec*, std::string> for_robot(Scenario& scenario, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw std::runtime_error(text + ": expected ROBOT=PATH");
  const std::string robot = text.substr(0, equals);
  for (std::size_t i = 0; i < scenario.robots.size(); ++i) {
    NodeSpec& spec = scenario.robots[i];
    if (spec.name == robot || robot == std::to_string(i) || robot == "k" + std::to_string(i))
      return {&spec, text.substr(equals + 1)};
  }
  throw std::runtime_error(text + ": there is no robot " + robot);
}

void add_options(CLI::App& app, Options& options, Scenario& overrides) {
  app.add_option("--scenario", options.scenario,
                 "TOML file; the other options change what it says");
  app.add_option("--grid", options.grid, "ROWSxCOLUMNS robots");
  app.add_option("--spacing-mm", options.spacing_mm, "distance in the grid");
  app.add_option("--image", options.image, "robots' program, ELF or Intel hex");
  app.add_option("--image-of", options.image_of, "ROBOT=PATH: another program for one robot");
  app.add_option("--bootloader", options.bootloader, "laid over the robots' programs");
  app.add_option("--ohc", options.ohc, "overhead controller's program");
  app.add_option("--ohc-pin", options.ohc_pin, "its infrared pin, B0 to D7");
  app.add_option("--pty", options.pty,
                 "name of a terminal for the overhead controller's serial line");
  app.add_option("--serial-pty", options.serial_pty, "ROBOT=PATH: a terminal for a robot's UART");
  app.add_option("--lamp", options.lamp,
                 "TYPE[:HEX]@SECONDS[xCOPIES]: messages without a controller");
  app.add_option("--send", options.send,
                 "COMMAND@SECONDS: to the overhead controller's serial line");
  app.add_option("--dump-flash", options.dump_flash, "ROBOT=PATH: its 32 KiB of flash at the end");
  app.add_option("--seconds", overrides.seconds, "emulated time; 0: until interrupted");
  app.add_option("--seed", overrides.seed, "of everything random");
  app.add_option("--log", overrides.log, "JSON lines; - for standard output");
  app.add_option("--log-heard", overrides.logs_heard, "true: log what arrives at each receiver");
  app.add_option("--watch", overrides.watch,
                 "SYMBOL[+OFFSET|-FROM_END][:BYTES]: log a variable's changes");
  app.add_option("--range-mm", overrides.medium.range_mm, "of a robot's light");
  app.add_option("--loss", overrides.medium.loss, "probability that a receiver misses a message");
  app.add_option("--pulse-loss", overrides.medium.pulse_loss, "the same for one pulse");
  app.add_option("--stray-pulses-per-s", overrides.medium.stray_pulses_per_s, "at each receiver");
  app.add_option("--noise-counts", overrides.noise_counts, "standard deviation of signal strength");
  app.add_option("--drift-ppm", overrides.drift_ppm, "clocks differ by at most this");
  app.add_option("--power-on-spread-ms", overrides.power_on_spread_ms, "robots start within this");
  app.add_option("--real-time", overrides.real_time_factor,
                 "at most this many times as fast as the wall clock; 0: as fast as it goes");
}

void apply(const Options& options, Scenario& scenario) {
  if (!options.grid.empty()) {
    NodeSpec each;
    each.image = options.image;
    add_grid(scenario, options.grid, options.spacing_mm, each);
  }
  for (NodeSpec& robot : scenario.robots) {
    if (!options.image.empty()) robot.image = options.image;
    if (!options.bootloader.empty()) robot.bootloader = options.bootloader;
  }
  for (const std::string& text : options.image_of) {
    const auto [robot, path] = for_robot(scenario, text);
    robot->image = path;
  }
  for (const std::string& text : options.serial_pty) {
    const auto [robot, path] = for_robot(scenario, text);
    robot->serial_pty = path;
    robot->has_pty = true;
  }
  if (!options.ohc.empty()) {
    if (!scenario.ohc) scenario.ohc = OhcSpec{};
    scenario.ohc->image = options.ohc;
    scenario.ohc->infrared_led = parse_pin(options.ohc_pin);
  }
  if (!options.pty.empty()) {
    if (!scenario.ohc) throw std::runtime_error("--pty needs an overhead controller (--ohc)");
    scenario.ohc->serial_pty = options.pty;
    scenario.ohc->has_pty = true;
  }
  for (const std::string& text : options.lamp) scenario.lamp.push_back(parse_lamp(text));
  for (const std::string& text : options.send) scenario.ohc_serial.push_back(parse_serial(text));
  if (scenario.seconds == 0) scenario.seconds = 1e9;
}

void dump_flash(const Emulation& emulation, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw std::runtime_error(text + ": expected ROBOT=PATH");
  const std::vector<std::uint8_t> flash = emulation.node(text.substr(0, equals)).mcu().flash();
  std::ofstream file(text.substr(equals + 1), std::ios::binary);
  file.write(reinterpret_cast<const char*>(flash.data()), kFlashBytes);
  if (!file.flush()) throw std::runtime_error(text + ": cannot be written");
}

int run(const Options& options, Scenario scenario) {
  apply(options, scenario);
  Emulation emulation(std::move(scenario));
  for (const auto& node : emulation.nodes())
    if (node->terminal() != nullptr)
      std::fprintf(stderr, "%s is at %s\n", node->name().c_str(),
                   node->terminal()->device().c_str());
  for (const std::string& variable : emulation.unknown_variables())
    std::fprintf(stderr, "no image has a variable \"%s\"\n", variable.c_str());
  emulation.scheduler().every(10'000'000, [&](std::uint64_t) {
    if (g_stop != 0) emulation.stop();
  });
  const std::clock_t cpu_before = std::clock();
  emulation.run();
  const double cpu_s = static_cast<double>(std::clock() - cpu_before) / CLOCKS_PER_SEC;
  for (const std::string& text : options.dump_flash) dump_flash(emulation, text);
  const double emulated_s = emulation.emulated_seconds();
  const auto nodes = static_cast<double>(emulation.nodes().size());
  std::uint64_t cycles = 0, slept = 0;
  for (const auto& node : emulation.nodes()) {
    cycles += node->mcu().cycle();
    slept += node->mcu().slept_cycles();
    if (node->mcu().is_dead())
      std::fprintf(stderr, "%s: %s\n", node->name().c_str(), node->mcu().crash().c_str());
  }
  std::fprintf(stderr,
               "emulated %.3f s of %.0f nodes in %.2f CPU-s: %.1f node-seconds per CPU-second "
               "(%.0f %% of cycles asleep)\n",
               emulated_s, nodes, cpu_s, emulated_s * nodes / cpu_s,
               100.0 * static_cast<double>(slept) / static_cast<double>(cycles));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Emulates Kilobots and an overhead controller with their firmware images.");
  Options options;
  Scenario scenario;
  add_options(app, options, scenario);
  // The options are read twice: once to find the scenario file, then again on top of it.
  CLI11_PARSE(app, argc, argv);
  try {
    if (!options.scenario.empty()) {
      scenario = load_scenario(options.scenario);
      app.clear();
      options = Options{};
      CLI11_PARSE(app, argc, argv);
    }
    swarmtalk::usage::catch_ending_signals([](int) { g_stop = 1; }, SA_RESTART);
    return run(options, std::move(scenario));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "kilobot-emulator: %s\n", error.what());
    return 1;
  }
}
