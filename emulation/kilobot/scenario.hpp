// Scenario: everything that decides a run, read from a TOML file or from command-line options. The
// format is described in docs/kilobot-emulator.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulation/kilobot/mcu.hpp"
#include "emulation/kilobot/medium.hpp"

namespace swarmtalk::emulator {

struct NodeSpec {
  std::string name;
  std::string image;                  // path; ELF or Intel hex
  std::string bootloader;             // path; laid over the image; "" for none
  std::string eeprom;                 // path; "" for a calibrated one
  std::string save_eeprom;            // path, written at the end; "" for none
  std::string serial_pty;             // name of the terminal for the UART; "" for none
  bool has_pty = false;               // a terminal, also without a name
  std::optional<std::uint16_t> uid;   // default: number of the robot, from 1
  std::optional<double> power_on_ms;  // default: random
  std::optional<double> drift_ppm;    // default: random
  Pin infrared_led;
  std::uint32_t clock_hz = 8'000'000;
  bool resets_to_bootloader = false;  // fuse BOOTRST
  double x_mm = 0;
  double y_mm = 0;
  double theta_rad = 0;
};

struct OhcSpec : NodeSpec {
  Pin status_led{'B', 1};
  double reach_mm = 1e9;
};

/// Bytes given to the OHC's serial line at a time, at its line rate.
struct SerialSpec {
  double at_s = 0;
  std::vector<std::uint8_t> bytes;
};

/// Infrared messages from a lamp above the robots that needs no image: an OHC without a processor.
struct LampSpec {
  double at_s = 0;
  IrMessage message{};
  unsigned copies = 50;
  double period_ms = 10.4;
};

/// How long a motor keeps the speed that chance gave it: as in the suite's simulator.
inline constexpr double kMotorNoiseMs = 32.768;

struct Scenario {
  MediumSettings medium;
  std::vector<NodeSpec> robots;
  std::optional<OhcSpec> ohc;
  std::vector<SerialSpec> ohc_serial;
  std::vector<LampSpec> lamp;
  std::vector<std::string> watch;  // SYMBOL[+OFFSET][:BYTES]
  std::string log;                 // path, "-" for standard output, "" for none
  bool logs_air = true;            // each message sent
  bool logs_heard = false;         // each message as it is at each receiver
  double seconds = 10;
  double real_time_factor = 0;      // 0: as fast as it goes
  double drift_ppm = 10'000;        // random drifts are within +- this; 1 % as an RC oscillator
  double power_on_spread_ms = 250;  // random power-on times are within this
  double sample_ms = 1;             // LED, motors and watched variables are looked at this often
  double baud = 38'400;             // of hosts that write to a node
  std::uint16_t noise_counts = 0;   // standard deviation of signal strengths
  double motor_bias = 0;            // of each motor's own speed, as a share; for good
  double motor_noise = 0;           // of its speed in each kMotorNoiseMs, as a share
  std::uint64_t seed = 1;
};

/// @throws std::runtime_error with the file, the line if known, and what is wrong
Scenario load_scenario(const std::string& path);

/// Robots in rows and columns around nothing in particular, the first at (0, 0).
/// @param size  "ROWSxCOLUMNS"
void add_grid(Scenario& scenario, const std::string& size, double spacing_mm, const NodeSpec& each);

/// "B0" to "D7". @throws std::runtime_error
Pin parse_pin(const std::string& text);

/// A variable to watch: bytes of a symbol of the image.
struct WatchSpec {
  std::string symbol;
  int offset = 0;
  bool is_from_end = false;  // the offset counts back from the symbol's end
  unsigned size_bytes = 0;   // 0: the symbol's, at most 8
};

/// SYMBOL[+OFFSET|-FROM_END][:BYTES]. @throws std::runtime_error
WatchSpec parse_watch(const std::string& text);

/// COMMAND@SECONDS, for example run@2.5: run, stop, wakeup, reset, sleep, charge, voltage, boot,
/// led, or hex:BYTES for any bytes. @throws std::runtime_error
SerialSpec parse_serial(const std::string& text);

/// TYPE[:HEXDATA]@SECONDS[xCOPIES], TYPE a command's name as above or a number: 0x02:0102@3x10.
/// @throws std::runtime_error
LampSpec parse_lamp(const std::string& text);

/// Fills in what is still open (names, uids, random drifts and power-on times) from the seed.
/// @throws std::runtime_error if a number is out of its range
void complete(Scenario& scenario);

}  // namespace swarmtalk::emulator
