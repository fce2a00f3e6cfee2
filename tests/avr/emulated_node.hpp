// The node of cycles_target.elf in libsimavr: does the steps of a story and tells how many cycles
// each call took, from entry to return (the writes that bracket it are counted too: 2 cycles). Can
// be put back into any state it was in. One thread.
#pragma once

#include <simavr/sim_avr.h>

#include <array>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "emulation/kilobot/skip_repair.hpp"
#include "tests/avr/story.hpp"

namespace swarmtalk::avr {

/// One measured call.
struct Call {
  bool is_pull;
  uint32_t cycles;
  uint32_t counted;  // a bit for each of the node's counters that it moved: what happened in it
};

class EmulatedNode {
 public:
  using Packet = std::array<uint8_t, 9>;
  /// All of the chip that a program can see, and what the host remembers beside it.
  struct State {
    std::vector<uint8_t> memory;  // registers, I/O, RAM
    std::array<uint8_t, 8> sreg;
    uint32_t pc;
    std::array<Packet, 16> pulled;  // the last ones, round and round
    uint8_t pulls;
  };
  /// Gets each measured call; a step may have several.
  using OnCall = std::function<void(const Call&)>;
  /// Gets the address of each instruction of a measured call, and its cycles.
  using OnInstruction = std::function<void(uint32_t pc, uint32_t cycles)>;

  /// Throws std::runtime_error if the image cannot be run.
  explicit EmulatedNode(const std::string& image);
  ~EmulatedNode();
  EmulatedNode(const EmulatedNode&) = delete;
  EmulatedNode& operator=(const EmulatedNode&) = delete;

  /// From a reset.
  void start(const Start& start);
  /// Throws std::runtime_error if the program ends or does not come back.
  void run(const Step& step, const OnCall& on_call);
  State save() const;
  void restore(const State& state);
  /// Runs one instruction at a time from here on, if not null: slow.
  void watch(OnInstruction on_instruction) { on_instruction_ = std::move(on_instruction); }

 private:
  static void on_bracket(avr_t* avr, avr_io_addr_t address, uint8_t value, void* param);
  static void on_ready(avr_t* avr, avr_io_addr_t address, uint8_t value, void* param);
  static void on_address(avr_t* avr, avr_io_addr_t address, uint8_t value, void* param);
  static void on_complaint(avr_t* avr, int level, const char* format, va_list values);
  void run_until_ready();
  void run_watched();
  void give(Command command);
  void measure(Command command, const OnCall& on_call);
  void hear(const Packet& packet, int16_t distance, const OnCall& on_call);
  void pull(uint32_t ticks, const OnCall& on_call);
  void send(const Step& step);
  void wait(uint32_t ticks);
  Packet packet_of(const Step& step) const;
  Packet echo_of(const Step& step) const;
  Mailbox mailbox() const;
  void write(const Mailbox& mailbox);

  avr_t* avr_;
  uint16_t mailbox_at_ = 0;
  emulator::SkipRepair skip_repair_;
  bool is_astray_ = false;
  bool is_ready_ = false;
  bool is_measuring_ = false;
  uint64_t began_ = 0;
  uint64_t took_ = 0;
  State fresh_;
  std::array<Packet, 16> pulled_ = {};
  uint8_t pulls_ = 0;
  OnInstruction on_instruction_;
};

}  // namespace swarmtalk::avr
