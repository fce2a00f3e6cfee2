// Ways out of a program: to the bootloader, to its own beginning; and the guard that keeps a robot
// reachable when its program hangs.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

/// Start of the bootloader: 4 KiB at the end of flash.
constexpr uint16_t kBootloaderAddress = 0x7000;

/// Leaves for the bootloader, all hardware as after a reset. Safe in interrupts.
[[noreturn]] void enter_bootloader();

/// Starts the program again from address 0. Safe in interrupts.
[[noreturn]] void restart_program();

/// Starts the guard: a program that hangs with interrupts off is reset after 16 s. One that hangs
/// with interrupts on still hears BOOT and RESET, and is left alone.
void start_guard();

/// The main loop still turns.
void feed_guard();

/// Stops the processor and its clocks for about 8 s. The receiver must be stopped.
void sleep_deeply();

}  // namespace kilobot
}  // namespace swarmtalk
