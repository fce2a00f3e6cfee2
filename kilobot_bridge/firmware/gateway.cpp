// Gateway: a Kilobot with a debug cable that reports every message it hears to the host, with its
// strength and distance, as KGU1 frames (gateway_frame.hpp) or, built with SWARMTALK_GATEWAY_TEXT,
// as lines of text. It never sends infrared, and no message stops it but BOOT and RESET, so it
// can be reprogrammed like any robot.
#include <avr/interrupt.h>
#include <avr/io.h>

#include "kilobot_bridge/firmware/serial_port.hpp"
#include "kilobot_bridge/firmware/text_line.hpp"
#include "kilobot_wire/gateway_frame.hpp"
#include "platforms/kilobot/adc.hpp"
#include "platforms/kilobot/board.hpp"
#include "platforms/kilobot/clock.hpp"
#include "platforms/kilobot/eeprom.hpp"
#include "platforms/kilobot/ir_receiver.hpp"
#include "platforms/kilobot/kilobot_robot.hpp"
#include "platforms/kilobot/restart.hpp"

namespace swarmtalk {
namespace kilobot {

void on_urgent_message(uint8_t type) {
  if (type == kIrBoot) enter_bootloader();
  if (type == kIrReset) restart_program();
}

}  // namespace kilobot
}  // namespace swarmtalk

namespace {

using namespace swarmtalk::kilobot;
using namespace swarmtalk::kilobot_bridge;

#if defined(SWARMTALK_GATEWAY_TEXT)
using Report = TextLine;
#else
using Report = GatewayFrame;
#endif

Report report;
uint8_t written;  // bytes of it that have left
uint8_t sequence;
int16_t battery;

/// Distance as a report carries it: one byte, 0xFF if unknown.
uint8_t report_mm(const IrReception& reception) {
  const int16_t mm = distance_mm(reception);
  return mm < 0 || mm > 254 ? kGatewayNoDistance : static_cast<uint8_t>(mm);
}

void report_reception(const IrReception& reception) {
  report.begin(GatewayKind::kReception, sequence++);
  report.append16(static_cast<uint16_t>(ticks()));
  for (uint8_t i = 0; i < kIrDataBytes; ++i) report.append(reception.message.data[i]);
  report.append(reception.message.type);
  report.append16(reception.low_gain);
  report.append16(reception.high_gain);
  report.append(report_mm(reception));
  report.end();
  written = 0;
}

void report_hello() {
  const int16_t reading = read_battery();
  if (reading >= 0) battery = reading;  // else a message is arriving: the last one will do
  report.begin(GatewayKind::kHello, sequence++);
  report.append16(static_cast<uint16_t>(ticks()));
  report.append16(read_uid());
  report.append(kGatewayProtocolVersion);
  report.append16(receptions_lost());
  report.append16(static_cast<uint16_t>(battery));
  report.append(0);
  report.end();
  written = 0;
}

/// The oldest message that waits, if it is a program's. Control messages are not reported.
void report_next() {
  const IrReception* reception = next_reception();
  if (reception == nullptr) return;
  if (reception->message.type < kIrFirstControl) report_reception(*reception);
  drop_reception();
}

}  // namespace

int main() {
  start_board();
  start_clock();
  sei();
  start_receiver();
  start_guard();
  start_serial(1 << TXEN0);
  uint32_t hello_tick = 0;
  for (;;) {
    feed_guard();
    if (written < report.size()) {
      if (can_write_serial()) write_serial(report.byte(written++));
    } else if (ticks() - hello_tick >= kTicksPerSecond) {
      hello_tick = ticks();
      report_hello();
      set_led(kLedWhite);
    } else {
      report_next();
      if (ticks() != hello_tick) set_led(kLedOff);
    }
  }
}
