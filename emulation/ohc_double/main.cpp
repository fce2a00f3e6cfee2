// ohc-double: an overhead controller that is not there, for hosts to talk to. Behind a pseudo
// terminal in real time, or (--virtual) driven by commands on standard input in virtual time. What
// happens comes out as JSON lines; docs/kilobot-emulator.md lists them and the commands.
#include <poll.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "emulation/kilobot/terminal_reader.hpp"
#include "emulation/ohc_double/bench.hpp"
#include "hex/digits.hpp"
#include "usage/ending_signals.hpp"

namespace {

using namespace swarmtalk::ohc_double;
using swarmtalk::emulator::PacedReader;
using swarmtalk::emulator::Pty;

volatile std::sig_atomic_t g_stop = 0;

struct Options {
  std::string pty, log = "-", dump_flash;
  bool is_virtual = false;
  double boot_ms = kBootNs / 1e6, loss = 0;
  unsigned robots = 1;
  std::uint64_t seed = 1;
};

std::vector<std::uint8_t> parse_hex(std::string digits) {
  std::erase_if(digits, [](unsigned char c) { return std::isspace(c) != 0; });
  if (digits.size() % 2 != 0 ||
      digits.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos)
    throw std::runtime_error("bytes must be pairs of hex digits");
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16)));
  return bytes;
}

/// Milliseconds as text, in nanoseconds.
std::uint64_t parse_ns(const std::string& text) {
  constexpr double kYearMs = 365.0 * 24 * 3600 * 1000;
  std::istringstream number(text);
  double ms = 0;
  if (!(number >> ms && ms >= 0 && ms <= kYearMs))
    throw std::runtime_error("expected milliseconds, at least 0");
  return static_cast<std::uint64_t>(ms * 1e6);
}

/// send HEX | wait MILLISECONDS | state | flash ROBOT BYTES. Each is answered by one line, after
/// the events that it has caused: state, flash or ready.
Bench::Json obey(Bench& bench, const std::string& line) {
  std::istringstream words(line);
  std::string command, rest;
  words >> command;
  std::getline(words, rest);
  if (command == "send") {
    bench.send(parse_hex(rest));
  } else if (command == "wait") {
    bench.wait_until(bench.now_ns() + parse_ns(rest));
  } else if (command == "state") {
    return bench.state();
  } else if (command == "flash") {
    std::istringstream numbers(rest);
    std::size_t robot = 0, size_bytes = 0;
    numbers >> robot >> size_bytes;
    if (!numbers || robot >= bench.robots().size())
      throw std::runtime_error("expected a robot, from 0 on, and a number of bytes");
    const auto& flash = bench.robots()[robot].flash();
    return {{"event", "flash"},
            {"hex",
             swarmtalk::hex::to_hex(std::span(flash).first(std::min(size_bytes, flash.size())))}};
  } else {
    throw std::runtime_error("unknown command");
  }
  return {{"event", "ready"}, {"time_us", bench.now_ns() / 1000}};
}

void run_virtual(Bench& bench, std::ostream& out) {
  for (std::string line; std::getline(std::cin, line);) {
    Bench::Json answer;
    try {
      answer = obey(bench, line);
    } catch (const std::exception& error) {
      answer = {{"event", "error"}, {"text", line + ": " + error.what()}};
    }
    out << answer.dump() << std::endl;
  }
}

/// Reads no faster than the line would bring the bytes: a pseudo terminal itself has no speed.
void run_terminal(Bench& bench, const std::string& path) {
  using Clock = std::chrono::steady_clock;
  swarmtalk::emulator::read_before_others();
  Pty terminal(path);
  std::cerr << "ohc is at " << terminal.device() << std::endl;
  const auto start = Clock::now();
  PacedReader line(terminal, kByteNs);
  while (g_stop == 0) {
    pollfd poller{terminal.descriptor(), POLLIN, 0};
    ::poll(&poller, 1, 1);
    const auto now_ns =
        static_cast<std::uint64_t>(std::chrono::nanoseconds(Clock::now() - start).count());
    while (const auto byte = line.next(now_ns)) bench.put(byte->byte, byte->at_ns);
    bench.wait_until(now_ns);
    std::this_thread::sleep_for(swarmtalk::emulator::kLinePoll);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Stands in for a Kilobot overhead controller and robots under it.");
  Options options;
  app.add_option("--pty", options.pty, "name of the pseudo terminal");
  app.add_flag("--virtual", options.is_virtual, "virtual time, commands on standard input");
  app.add_option("--log", options.log, "JSON lines; - for standard output");
  app.add_option("--robots", options.robots, "virtual robots under it")->check(CLI::Range(1, 1000));
  app.add_option("--loss", options.loss, "probability that a robot misses a message")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--seed", options.seed, "of the losses");
  app.add_option("--boot-ms", options.boot_ms, "time after the start in which it does not act")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--dump-flash", options.dump_flash, "file for robot 0's flash at the end");
  CLI11_PARSE(app, argc, argv);
  try {
    std::ofstream file;
    if (options.log != "-") {
      file.open(options.log);
      if (!file) throw std::runtime_error(options.log + ": cannot be written");
    }
    std::ostream& out = options.log == "-" ? std::cout : file;
    Bench::Settings settings;
    settings.robots = options.robots;
    settings.loss = options.loss;
    settings.seed = options.seed;
    settings.boot_ns = static_cast<std::uint64_t>(options.boot_ms * 1e6);
    Bench bench(settings, [&](const Bench::Json& event) { out << event.dump() << std::endl; });
    swarmtalk::usage::catch_ending_signals([](int) { g_stop = 1; }, SA_RESTART);
    if (options.is_virtual)
      run_virtual(bench, out);
    else
      run_terminal(bench, options.pty);
    out << bench.state().dump() << std::endl;
    if (!options.dump_flash.empty()) {
      const auto& flash = bench.robots().at(0).flash();
      std::ofstream dump(options.dump_flash, std::ios::binary);
      dump.write(reinterpret_cast<const char*>(flash.data()),
                 static_cast<std::streamsize>(flash.size()));
    }
  } catch (const std::exception& error) {
    std::cerr << "ohc-double: " << error.what() << std::endl;
    return 1;
  }
}
