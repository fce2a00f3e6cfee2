// Firmware of the overhead controller: forwards messages from a host to all robots in its light.
// Serial frames as in overhead_frame.hpp, the same as the stock firmware's; it answers kVersion,
// and it hears serial bytes while it sends, since timer 1 keeps the rhythm of the slots.
// Main loop: act on the last frame. Interrupt: collect serial bytes.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/delay.h>

#include "kilobot_bridge/firmware/overhead_pins.hpp"
#include "kilobot_bridge/firmware/serial_port.hpp"
#include "kilobot_wire/gateway_frame.hpp"
#include "kilobot_wire/overhead_frame.hpp"
#include "platforms/kilobot/ir_waveform.hpp"

namespace {

using namespace swarmtalk::kilobot;
using namespace swarmtalk::kilobot_bridge;

constexpr uint8_t kVersion = 2;
constexpr uint8_t kMessagesPerPage = 22;
constexpr uint8_t kBytesPerMessage = 6;

OverheadFrameFinder finder;
volatile bool has_frame;
uint8_t frame[kOverheadFrameBytes];  // the one acted on
bool is_led_wanted;

/// An interrupt within a pulse would stretch it: off for its nine cycles.
struct Pulse {
  void operator()() const {
    const uint8_t lit = static_cast<uint8_t>(infrared_port() | kInfraredPin);
    const uint8_t dark = static_cast<uint8_t>(lit & ~kInfraredPin);
    cli();
    infrared_port() = lit;
    __builtin_avr_delay_cycles(kIrPulseCycles - 1);
    infrared_port() = dark;
    sei();
  }
};

void set_led(bool on) {
  if (on) {
    led_port() |= kLedPin;
  } else {
    led_port() &= static_cast<uint8_t>(~kLedPin);
  }
}

/// One message, 4.4 ms. Nobody is listened to: robots give way to the controller.
void send(const IrMessage& message, uint16_t crc) {
  SlotTimer timer;
  const Pulse pulse;
  send_ir_byte(timer, 0, pulse);
  send_ir_body(timer, message, crc, pulse);
  // Two slots of darkness, so that a receiver has ended this message before the next begins.
  timer.wait();
  timer.wait();
}

void send(const IrMessage& message) {
  send(message, ir_crc(message));
}

IrMessage message_in_frame() {
  IrMessage message;
  for (uint8_t i = 0; i < kIrDataBytes; ++i) message.data[i] = frame[kOverheadPayload + i];
  message.type = frame[kOverheadPayload + kIrDataBytes];
  return message;
}

/// 3 ms of light show that something is sent, 3 ms of dark that it goes on.
void forward(uint16_t crc) {
  send(message_in_frame(), crc);
  set_led(true);
  _delay_ms(3);
  set_led(false);
  _delay_ms(3);
}

uint16_t word_in_frame(uint8_t offset) {
  const uint16_t high = frame[offset + 1];
  return static_cast<uint16_t>((high << 8) | frame[offset]);
}

/// Or until the host has been silent for so long that it must be dead.
void forward_until_next_frame(uint16_t crc) {
  uint16_t copies = word_in_frame(kOverheadCopies);
  const uint16_t check = word_in_frame(kOverheadCopies + 2);
  if (copies != static_cast<uint16_t>(~check) || copies > kMostCopies) copies = kMostCopies;
  for (; copies != 0 && !has_frame; --copies) forward(crc);
}

/// Behind a page or positions.
void blink() {
  set_led(true);
  _delay_ms(10);
  set_led(false);
  _delay_ms(10);
}

/// 21 messages of 6 bytes and one of 2: a robot needs all of them.
void send_page() {
  for (uint8_t i = 0; i < kMessagesPerPage; ++i) {
    const uint8_t first = static_cast<uint8_t>(i * kBytesPerMessage);
    IrMessage message = {{frame[kOverheadPayload], static_cast<uint8_t>(first / 2)}, kIrPage};
    for (uint8_t k = 0; k < kBytesPerMessage && first + k < kProgramPageBytes; ++k) {
      message.data[2 + k] = frame[kOverheadPageData + first + k];
    }
    send(message);
  }
}

void send_gps() {
  for (uint8_t record = 0; record < kGpsRecords; ++record) {
    IrMessage message = {{}, kIrGps};
    uint8_t any = 0;
    for (uint8_t i = 0; i < kGpsRecordBytes; ++i) {
      message.data[i] = frame[kOverheadPayload + record * kGpsRecordBytes + i];
      any |= message.data[i];
    }
    if (any == 0) return;
    message.data[kGpsRecordBytes - 1] = 0;
    send(message);
  }
}

void report_version() {
  static uint8_t sequence;
  GatewayFrame report;
  report.begin(GatewayKind::kVersion, sequence++);
  report.append(kProductOverhead);
  report.append(kVersion);
  report.append16(0xFF);  // types 0 to 7
  report.append(kHearsWhileSending | kEndsByItself);
  report.end();
  for (uint8_t i = 0; i < report.size(); ++i) {
    while (!can_write_serial()) {
    }
    write_serial(report.byte(i));
  }
}

/// Further bytes may arrive meanwhile; the finder keeps the frame for another 32 ms of them.
void take_frame() {
  has_frame = false;
  for (uint8_t i = 0; i < kOverheadFrameBytes; ++i) frame[i] = finder.frame_byte(i);
}

void act() {
  switch (static_cast<OverheadType>(frame[1])) {
    case OverheadType::kLedToggle:
      // A flag of its own, as with the stock controller: what was sent since has put the LED out.
      is_led_wanted = !is_led_wanted;
      set_led(is_led_wanted);
      break;
    case OverheadType::kForward:
      forward_until_next_frame(ir_crc(message_in_frame()));
      break;
    case OverheadType::kForwardRaw:
      forward_until_next_frame(word_in_frame(kOverheadPayload + kIrBodyBytes));
      break;
    case OverheadType::kForwardSingle:
      forward(ir_crc(message_in_frame()));
      break;
    case OverheadType::kPage:
      // Past the last page of programs lies the robots' bootloader: never.
      if (frame[kOverheadPayload] >= kProgramPages) break;
      send_page();
      blink();
      break;
    case OverheadType::kGps:
      send_gps();
      blink();
      break;
    case OverheadType::kVersion:
      report_version();
      break;
    default:
      break;
  }
}

}  // namespace

ISR(USART_RX_vect) {
  if (finder.on_byte(UDR0)) has_frame = true;
}

int main() {
#if defined(SWARMTALK_16_MHZ)
  // A board with a 16 MHz crystal runs as one with 8 (data sheet sec. 9.11).
  CLKPR = 1 << CLKPCE;
  CLKPR = 1 << CLKPS0;
#endif
#if defined(SWARMTALK_AT_BOOT_SECTION)
  // The vectors are where the program is.
  MCUCR = 1 << IVCE;
  MCUCR = 1 << IVSEL;
#endif
  ACSR = 1 << ACD;
  start_overhead_pins();
  start_serial((1 << TXEN0) | (1 << RXEN0) | (1 << RXCIE0));
  sei();
  for (uint8_t i = 0; i < 5; ++i) {
    set_led(true);
    _delay_ms(200);
    set_led(false);
    _delay_ms(200);
  }
  for (;;) {
    if (!has_frame) continue;
    take_frame();
    act();
  }
}
