// Bootloader: takes a program over infrared, page by page, and starts it. Lives in the last 4 KiB
// of flash, at 0x7000, and speaks the protocol of the robots' standard one; unlike that one it
// checks page numbers, so that nothing on the air can overwrite it, and keeps each part of a page
// that it has heard: what is missing comes with the next pass. Polls everything: no interrupt is
// ever on.
//
// A page with holes is written as it is, with ones in the holes, which later writes fill without
// erasing (data sheet sec. 27.2: a write only clears bits). Page 0 waits in RAM and is written
// last; a jump to the bootloader stands in for it, so a robot that loses power comes back here.
// While page 0 itself is erased and written (9 ms, twice) only the fuse BOOTRST helps: with it a
// reset begins here, and the program is started if its first page is in place.
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
constexpr uint8_t kParts = 22;                   // the last one holds two bytes of the page
constexpr uint8_t kPartBits = (kParts + 7) / 8;  // bytes that hold a bit for each part
constexpr uint8_t kTicksPerFlash = 31;           // timer 0 overflows per second

static_assert(kPageBytes == SPM_PAGESIZE, "a page of the protocol is a page of flash");

constexpr uint8_t kQuietTicks = 80;  // 10 ms of timer 0 behind the last pulse: a page is over

/// "jmp 0x7000" as two words of flash.
constexpr uint16_t kJump = 0x940C;
constexpr uint16_t kBootloaderWord = 0x7000 / 2;

IrDecoder decoder;
uint8_t body[kIrMessageBytes];            // of the message being received
uint8_t first_page[kParts * kPartBytes];  // page 0, until all others are whole
uint8_t page_data[kParts * kPartBytes];   // of the page in hand: its new parts, else ones
uint8_t new_parts[kPartBits];             // a bit for each part that is not in flash yet
bool has_new_parts;
uint8_t page;                           // which page that is
uint8_t parts_kept[kPages][kPartBits];  // in flash; of page 0 in first_page
bool is_any_kept;
bool has_stand_in;   // flash has the jump in the place of page 0
uint8_t page_count;  // of the whole program
uint8_t quiet_from;  // timer 0 at the last pulse

bool is_all(const uint8_t* kept, const uint8_t* more) {
  constexpr uint8_t kRest = (1 << (kParts % 8)) - 1;
  return (kept[0] | more[0]) == 0xFF && (kept[1] | more[1]) == 0xFF && (kept[2] | more[2]) == kRest;
}

bool is_done(uint8_t number) {
  return is_all(parts_kept[number], parts_kept[number]);
}

bool is_begun(uint8_t number) {
  return (parts_kept[number][0] | parts_kept[number][1] | parts_kept[number][2]) != 0;
}

/// Pages beyond the program's count for nothing.
bool is_whole() {
  for (uint8_t i = 0; i < page_count; ++i) {
    if (!is_done(i)) return false;
  }
  return true;
}

void forget_new_parts() {
  for (uint8_t& byte : page_data) byte = 0xFF;
  for (uint8_t& bits : new_parts) bits = 0;
  has_new_parts = false;
}

void begin_again() {
  for (uint8_t i = 0; i < kPages; ++i) {
    for (uint8_t& bits : parts_kept[i]) bits = 0;
  }
  is_any_kept = false;
  page_count = kPages;
  forget_new_parts();
}

/// Whether there is a program: erased flash reads 0xFFFF, and the jump back here is none.
bool has_program() {
  const uint16_t first = pgm_read_word(0);
  return first != 0xFFFF && (first != kJump || pgm_read_word(2) != kBootloaderWord);
}

/// Up to 9 ms. This code runs on meanwhile, from the section of flash that can be read while the
/// other is written (data sheet sec. 27.4).
void write_flash(uint8_t number, const uint8_t* bytes, bool erases) {
  const uint16_t address = static_cast<uint16_t>(number * uint16_t{kPageBytes});
  if (erases) {
    boot_page_erase(address);
    boot_spm_busy_wait();
  }
  for (uint8_t i = 0; i < kPageBytes; i = static_cast<uint8_t>(i + 2)) {
    const uint16_t high = bytes[i + 1];
    boot_page_fill(address + i, static_cast<uint16_t>((high << 8) | bytes[i]));
  }
  boot_page_write(address);
  boot_spm_busy_wait();
  boot_rww_enable();
}

void write_stand_in() {
  uint8_t jump[kPageBytes];
  for (uint8_t& byte : jump) byte = 0xFF;
  jump[0] = kJump & 0xFF;
  jump[1] = kJump >> 8;
  jump[2] = kBootloaderWord & 0xFF;
  jump[3] = kBootloaderWord >> 8;
  write_flash(0, jump, true);
  has_stand_in = true;
}

[[noreturn]] void start_program() {
  stop_board();
  reinterpret_cast<void (*)()>(0)();
  __builtin_unreachable();
}

[[noreturn]] void start_new_program() {
  write_flash(0, first_page, true);
  start_program();
}

/// What is new of the page in hand, into flash.
void flush() {
  if (!has_new_parts) return;
  if (page != 0) {
    if (!has_stand_in) write_stand_in();
    write_flash(page, page_data, !is_begun(page));
  }
  for (uint8_t i = 0; i < kPartBits; ++i) parts_kept[page][i] |= new_parts[i];
  is_any_kept = true;
  forget_new_parts();
  if (is_done(page)) set_led(kLedGreen);
  if (is_whole()) start_new_program();
}

/// Quick, but for a page that has come to its end: the next message begins 67 us behind this one.
void take_part(const uint8_t* data) {
  const uint8_t number = data[0];
  const uint8_t part = static_cast<uint8_t>(data[1] / 3);
  if (number >= kPages || data[1] % 3 != 0 || part >= kParts) return;
  if (number != page) {
    flush();
    page = number;
  }
  const uint8_t bit = static_cast<uint8_t>(1 << (part % 8));
  const uint8_t* const kept = parts_kept[number];
  if (((kept[part / 8] | new_parts[part / 8]) & bit) != 0) return;
  set_led(kLedDimBlue);
  uint8_t* const bytes = (number == 0 ? first_page : page_data) + part * kPartBytes;
  for (uint8_t i = 0; i < kPartBytes; ++i) bytes[i] = data[2 + i];
  new_parts[part / 8] |= bit;
  has_new_parts = true;
  if (is_all(kept, new_parts)) flush();
}

void take_message() {
  const uint8_t type = body[kIrDataBytes];
  if (type == kIrPage) {
    take_part(body);
  } else if (type == kIrPages) {
    if (body[0] == 0 || body[0] > kPages) return;
    page_count = body[0];
    if (is_whole()) start_new_program();
  } else if (type == kIrBoot) {
    begin_again();
  } else if (!is_any_kept && has_program()) {
    start_program();
  }
}

/// Whether a reset began here. A program that jumps here has left its timer running, or has cleared
/// the cause of its own reset.
bool is_reset() {
  return GPIOR0 != 0 && TCCR0B == 0;
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
  quiet_from = TCNT0;
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
  if (is_any_kept || has_new_parts) return;
  set_led(ticks == 0 ? kLedBlue : kLedOff);
  ticks = static_cast<uint8_t>((ticks + 1) % kTicksPerFlash);
}

}  // namespace

/// A watchdog that the program left running would interrupt.
extern "C" void __attribute__((naked, used, section(".init3"))) swarmtalk_stop_watchdog() {
  GPIOR0 = MCUSR;
  MCUSR = 0;
  wdt_disable();
}

int main() {
  if (is_reset() && has_program()) start_program();
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
    } else if (has_new_parts && static_cast<uint8_t>(TCNT0 - quiet_from) >= kQuietTicks) {
      flush();
    } else {
      show_waiting();
    }
  }
}
