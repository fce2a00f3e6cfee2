// Bootloader: takes a program over infrared, page by page, and starts it. Lives in the last 4 KiB
// of flash, at 0x7000, and speaks the protocol of the robots' standard one; unlike that one it
// checks page numbers, so that nothing on the air can overwrite it, and writes a page only when
// each part of it has come. Polls everything: no interrupt is ever on.
//
// Messages: kIrPages data[0] = pages of the program; kIrPage data[0] = page, data[1] = word offset
// (0, 3, ... 63), data[2..7] = three words; kIrBoot begins anew; anything else starts the program
// if nothing has been taken yet.
#include <avr/boot.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/wdt.h>

#include "platforms/kilobot/board.hpp"
#include "platforms/kilobot/ir_decoder.hpp"

namespace {

using namespace swarmtalk::kilobot;

constexpr uint8_t kPages = 220;  // the program's; what lies behind is not ours to write
constexpr uint8_t kPageBytes = 128;
constexpr uint8_t kPartBytes = 6;
constexpr uint8_t kParts = 22;  // the last one holds two bytes of the page
constexpr uint32_t kAllParts = (UINT32_C(1) << kParts) - 1;
constexpr uint8_t kTicksPerFlash = 31;  // timer 0 overflows per second

static_assert(kPageBytes == SPM_PAGESIZE, "a page of the protocol is a page of flash");

IrDecoder decoder;
uint8_t body[kIrMessageBytes];  // of the message being received
uint8_t page_data[kParts * kPartBytes];
uint32_t parts;  // of the page in page_data
uint8_t page;    // which page that is
uint8_t pages_done[(kPages + 7) / 8];
bool is_any_done;
uint8_t page_count;  // of the whole program

bool is_done(uint8_t number) {
  return (pages_done[number / 8] & (1 << (number % 8))) != 0;
}

/// Pages beyond the program's count for nothing.
bool is_whole() {
  for (uint8_t i = 0; i < page_count; ++i) {
    if (!is_done(i)) return false;
  }
  return true;
}

void begin_again() {
  for (uint8_t& byte : pages_done) byte = 0;
  is_any_done = false;
  page_count = kPages;
  page = 0;
  parts = 0;
}

[[noreturn]] void start_program() {
  stop_board();
  reinterpret_cast<void (*)()>(0)();
  __builtin_unreachable();
}

/// Whether there is a program: erased flash reads 0xFFFF.
bool has_program() {
  return pgm_read_word(0) != 0xFFFF;
}

/// Erases and writes the page, up to 9 ms. This code runs on meanwhile, from the section of flash
/// that can be read while the other is written (data sheet sec. 27.4).
void write_page() {
  const uint16_t address = static_cast<uint16_t>(page * uint16_t{kPageBytes});
  boot_page_erase(address);
  boot_spm_busy_wait();
  for (uint8_t i = 0; i < kPageBytes; i = static_cast<uint8_t>(i + 2)) {
    const uint16_t high = page_data[i + 1];
    boot_page_fill(address + i, static_cast<uint16_t>((high << 8) | page_data[i]));
  }
  boot_page_write(address);
  boot_spm_busy_wait();
  boot_rww_enable();
}

void take_part(const uint8_t* data) {
  const uint8_t number = data[0];
  const uint8_t part = static_cast<uint8_t>(data[1] / 3);
  if (number >= kPages || data[1] % 3 != 0 || part >= kParts) return;
  if (number != page) {
    page = number;
    parts = 0;
  }
  if (is_done(number)) return;
  set_led(kLedBlue);
  for (uint8_t i = 0; i < kPartBytes; ++i) page_data[part * kPartBytes + i] = data[2 + i];
  parts |= UINT32_C(1) << part;
  if (parts != kAllParts) return;
  write_page();
  parts = 0;
  pages_done[number / 8] |= static_cast<uint8_t>(1 << (number % 8));
  is_any_done = true;
  set_led(kLedGreen);
  if (is_whole()) start_program();
}

void take_message() {
  const uint8_t type = body[kIrDataBytes];
  if (type == kIrPage) {
    take_part(body);
  } else if (type == kIrPages) {
    if (body[0] == 0 || body[0] > kPages) return;
    page_count = body[0];
    if (is_whole()) start_program();
  } else if (type == kIrBoot) {
    begin_again();
  } else if (!is_any_done && has_program()) {
    start_program();
  }
}

bool is_timing() {
  return (TCCR1B & (1 << CS10)) != 0;
}

void start_timing() {
  TCNT1 = 0;
  TCCR1B = 1 << CS10;
}

void on_pulse() {
  if (!is_timing()) {
    start_timing();
    decoder.begin();
    return;
  }
  const uint16_t cycles = TCNT1;
  const IrEvent event = decoder.on_pulse(cycles);
  if (event == IrEvent::kByteStart) TCNT1 = 0;
  if (event == IrEvent::kByte || event == IrEvent::kLast) body[decoder.index()] = decoder.byte();
  if (event != IrEvent::kLast && event != IrEvent::kAbort) return;
  TCCR1B = 0;
  if (event == IrEvent::kLast && decoder.is_intact()) take_message();
}

/// A short blue flash each second shows that the robot waits.
void show_waiting() {
  static uint8_t ticks;
  if ((TIFR0 & (1 << TOV0)) == 0) return;
  TIFR0 = 1 << TOV0;
  if (is_any_done || parts != 0) return;
  set_led(ticks == 0 ? kLedBlue : kLedOff);
  ticks = static_cast<uint8_t>((ticks + 1) % kTicksPerFlash);
}

}  // namespace

/// A watchdog that the program left running would interrupt.
extern "C" void __attribute__((naked, used, section(".init3"))) swarmtalk_stop_watchdog() {
  MCUSR = 0;
  wdt_disable();
}

int main() {
  start_board();
  begin_again();
  TCCR0B = (1 << CS02) | (1 << CS00);
  constexpr uint8_t kRisingEdge = (1 << ACIS1) | (1 << ACIS0);
  ACSR = (1 << ACI) | kRisingEdge;
  for (;;) {
    if ((ACSR & (1 << ACI)) != 0) {
      ACSR = (1 << ACI) | kRisingEdge;
      on_pulse();
    } else if (is_timing()) {
      if (TCNT1 > kIrSilenceCycles) TCCR1B = 0;
    } else {
      show_waiting();
    }
  }
}
