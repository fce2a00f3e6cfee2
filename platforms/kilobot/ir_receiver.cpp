#include "platforms/kilobot/ir_receiver.hpp"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "platforms/kilobot/adc.hpp"
#include "platforms/kilobot/clock.hpp"
#include "platforms/kilobot/ir_decoder.hpp"

namespace swarmtalk {
namespace kilobot {

namespace {

constexpr uint8_t kSlots = kIrWaiting + 1;  // the one at `receiving` is written by the interrupt
static_assert((kSlots & (kSlots - 1)) == 0, "the ring's size is a power of two");

IrDecoder decoder;
IrReception ring[kSlots];
volatile uint8_t receiving;  // written by the interrupt
volatile uint8_t oldest;     // written by the main loop
volatile uint16_t lost_count;
volatile uint8_t heard_count;
uint8_t strengths;  // readings of this message taken so far, 0 to 2

/// Timer 1 runs only while a message arrives.
bool is_timing() { return (TCCR1B & (1 << CS10)) != 0; }

void start_timing() {
  TCNT1 = 0;
  OCR1A = kIrSilenceCycles;
  TIFR1 = 1 << OCF1A;
  TCCR1B = 1 << CS10;
}

void listen_for_leader() {
  TCCR1B = 0;
  ADMUX = kAdcHighGain;
  strengths = 0;
}

/// The converter is triggered by every pulse and holds the last pulse's reading until it has
/// finished with this one's (13 converter clocks, 104 cycles). So the leading byte's stop pulse
/// brings the reading of its start pulse, and the second pulse of the first byte that of its
/// first. A new channel counts from the next pulse on (data sheet sec. 24.5).
void take_strength(IrReception& slot) {
  if (strengths == 0) {
    slot.high_gain = ADC;
    ADMUX = kAdcLowGain;
  } else {
    slot.low_gain = ADC;
  }
  ++strengths;
}

void store_byte(IrReception& slot) {
  const uint8_t index = decoder.index();
  if (index < kIrDataBytes) {
    slot.message.data[index] = decoder.byte();
  } else if (index == kIrDataBytes) {
    slot.message.type = decoder.byte();
  }
}

void finish(const IrReception& slot) {
  heard_count = static_cast<uint8_t>(heard_count + 1);
  const uint8_t type = slot.message.type;
  if (type >= kIrFirstControl) on_urgent_message(type);
  const uint8_t next = static_cast<uint8_t>((receiving + 1) % kSlots);
  if (next == oldest) {
    lost_count = static_cast<uint16_t>(lost_count + 1);
  } else {
    receiving = next;
  }
  wake_up();
}

}  // namespace

ISR(ANALOG_COMP_vect) {
  if (!is_timing()) {
    start_timing();
    decoder.begin();
    return;
  }
  const uint16_t cycles = TCNT1;
  IrReception& slot = ring[receiving];
  const IrEvent event = decoder.on_pulse(cycles);
  if (event == IrEvent::kBit) {
    if (strengths == 1) take_strength(slot);
  } else if (event == IrEvent::kByteStart) {
    TCNT1 = 0;
  } else if (event == IrEvent::kLeaderEnd) {
    take_strength(slot);
  } else if (event == IrEvent::kByte) {
    if (strengths == 1) take_strength(slot);
    store_byte(slot);
  } else {
    listen_for_leader();
    if (event == IrEvent::kMessage) finish(slot);
  }
}

ISR(TIMER1_COMPA_vect) { listen_for_leader(); }

void start_receiver() {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    TCCR1A = 0;
    listen_for_leader();
    TIMSK1 = 1 << OCIE1A;
    ADCSRB = 1 << ADTS0;  // triggered by the comparator
    ADCSRA = (1 << ADEN) | (1 << ADATE) | (1 << ADPS1) | (1 << ADPS0);
    ACSR = (1 << ACI) | (1 << ACIE) | (1 << ACIS1) | (1 << ACIS0);  // rising edge
  }
}

void stop_receiver() {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    ACSR = (1 << ACI) | (1 << ACIS1) | (1 << ACIS0);
    TIMSK1 = 0;
    listen_for_leader();
  }
}

bool is_receiving() { return is_timing(); }

const IrReception* next_reception() { return oldest == receiving ? nullptr : &ring[oldest]; }

void drop_reception() { oldest = static_cast<uint8_t>((oldest + 1) % kSlots); }

uint16_t receptions_lost() {
  uint16_t count;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { count = lost_count; }
  return count;
}

uint8_t receptions_heard() { return heard_count; }

}  // namespace kilobot
}  // namespace swarmtalk
