// KilobotDouble: stands in for a Kilobot that an overhead controller speaks to: what its state,
// LED, motors, EEPROM and flash become with each infrared message, in the program and in the
// bootloader. Has no program: "running" means that a program would.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "emulation/kilobot/ir_frame.hpp"
#include "emulation/kilobot/random.hpp"

namespace swarmtalk::ohc_double {

class KilobotDouble {
 public:
  enum class State : std::uint8_t {
    kSleeping,
    kIdle,
    kBattery,
    kRunning,
    kCharging,
    kMoving,
    kBootloader
  };
  struct Motors {  // duty; what the program would set is not known
    std::uint8_t left = 0, right = 0;
    bool operator==(const Motors&) const = default;
  };
  struct Values {  // of calibration, in EEPROM and in RAM
    std::uint16_t uid = 0;
    std::uint8_t turn_left = 70, turn_right = 70, straight_left = 65, straight_right = 65;
    bool operator==(const Values&) const = default;
  };

  static constexpr std::size_t kPageBytes = 128;
  static constexpr unsigned kProgramPages = 220;    // a program's at most
  static constexpr unsigned kBootloaderPage = 224;  // the first one of the bootloader itself
  static constexpr unsigned kFlashPages = 256;
  static constexpr std::uint64_t kSleepPeriodNs = 8'000'000'000;
  static constexpr std::uint64_t kListenNs = 10'000'000;
  static constexpr std::uint64_t kListenMoreNs = 100'000'000;

  /// @param loss  probability that it misses a message, 0..1
  KilobotDouble(std::uint16_t uid, double loss, std::uint64_t seed);

  /// An undamaged message is on the air. Times must not fall.
  void hear(const emulator::IrMessage& message, std::uint64_t time_ns);

  State state() const { return state_; }
  const Values& eeprom() const { return eeprom_; }
  const Values& values() const { return values_; }
  bool has_motors_enabled() const { return has_motors_enabled_; }
  const Motors& motors() const { return motors_; }
  std::string_view led() const { return led_; }
  const std::vector<std::uint8_t>& flash() const { return flash_; }
  unsigned setups() const { return setups_; }    // calls of setup() since the last reset
  unsigned starts() const { return starts_; }    // of the program, since the beginning
  unsigned pages_done() const { return done_; }  // in the bootloader
  bool has_damaged_bootloader() const { return has_damaged_bootloader_; }

  /// Messages for the program, types 0..0x7F, in every state except in the bootloader.
  std::function<void(const emulator::IrMessage&)> on_user_message;

 private:
  void restart();
  void enter_bootloader();
  void hear_in_program(const emulator::IrMessage& message, std::uint64_t time_ns);
  void hear_in_bootloader(const emulator::IrMessage& message);
  void take_page_message(const emulator::IrMessage& message);
  void calibrate(const emulator::IrMessage& message);
  bool is_listening(std::uint64_t time_ns);

  State state_ = State::kIdle;
  Values eeprom_;
  Values values_;
  Motors motors_;
  bool has_motors_enabled_ = false;
  std::string_view led_ = "green blinking";
  unsigned setups_ = 0;
  unsigned starts_ = 1;
  std::uint64_t asleep_since_ns_ = 0;
  std::uint64_t awake_until_ns_ = 0;

  std::vector<std::uint8_t> flash_ = std::vector<std::uint8_t>(kFlashPages * kPageBytes, 0xFF);
  std::array<std::uint8_t, kPageBytes + 4> page_buffer_{};  // two spare words
  std::bitset<kFlashPages> is_done_;
  unsigned total_ = kProgramPages;
  unsigned done_ = 0;
  unsigned page_ = 0;
  unsigned byte_count_ = 0;
  bool has_damaged_bootloader_ = false;

  double loss_;
  emulator::Random chance_;
};

/// "sleeping", "idle", ...
std::string_view to_text(KilobotDouble::State state);

}  // namespace swarmtalk::ohc_double
