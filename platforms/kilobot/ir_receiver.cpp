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
volatile uint8_t receiving;  // written by the interrupts
volatile uint8_t oldest;     // written by the main loop
volatile uint16_t lost_count;
volatile bool is_garbled;
volatile bool is_complete;  // all bytes of a message have come

/// Timer 1 runs only while a message arrives.
bool is_timing() {
  return (TCCR1B & (1 << CS10)) != 0;
}

/// Cycles that pass between reading the timer and setting it to what it would be had it been reset
/// at the reading; and from a first pulse's interrupt to starting the timer, less to reading it.
constexpr uint8_t kRebaseCycles = 4;
constexpr uint8_t kStartCycles = 14;
/// Long enough for the timer's compare to be set before it is reached.
constexpr uint8_t kSoonCycles = 16;

/// Timer 1 counts from where it was read in this interrupt: the time of decoding does not shift
/// the byte's start.
inline void rebase_timing(uint16_t cycles) {
  TCNT1 = static_cast<uint16_t>(TCNT1 - cycles + kRebaseCycles);
}

inline void start_timing() {
  TCNT1 = kStartCycles;
  OCR1A = kIrSilenceCycles;
  TIFR1 = 1 << OCF1A;
  TCCR1B = 1 << CS10;
}

inline void listen_for_leader() {
  TCCR1B = 0;
  ADMUX = kAdcHighGain;
}

/// The converter is triggered by every pulse and holds the last pulse's reading until it has
/// finished with this one's (13 converter clocks, 104 cycles). So the leading byte's stop pulse
/// brings the reading of its start pulse, and the first byte's stop pulse that of a pulse before
/// it, by the other amplifier stage. A new channel counts from the next pulse on (data sheet
/// sec. 24.5).
inline void store_byte(IrReception& slot, uint8_t index, uint8_t byte) {
  if (index == 0) slot.low_gain = ADC;
  if (index < kIrBodyBytes) reinterpret_cast<uint8_t*>(&slot.message)[index] = byte;
}

void finish() {
  const uint8_t type = ring[receiving].message.type;
  if (type >= kIrFirstControl) on_urgent_message(type);
  const uint8_t next = static_cast<uint8_t>((receiving + 1) % kSlots);
  if (next == oldest) {
    lost_count = static_cast<uint16_t>(lost_count + 1);
  } else {
    receiving = next;
  }
}

}  // namespace

/// One pulse. Short, because the next may come after 269 cycles, from a fast clock after 255: it
/// calls nothing, so few registers are saved, and leaves a whole message to timer 1.
ISR(ANALOG_COMP_vect) {
  if (!is_timing()) {
    start_timing();
    decoder.begin();
    return;
  }
  const uint16_t cycles = TCNT1;
  const IrEvent event = decoder.on_pulse(cycles);
  if (event == IrEvent::kBit) return;
  if (event == IrEvent::kByteStart) {
    rebase_timing(cycles);
  } else if (event == IrEvent::kLeaderEnd) {
    ring[receiving].high_gain = ADC;
    ADMUX = kAdcLowGain;
  } else if (event == IrEvent::kByte) {
    store_byte(ring[receiving], decoder.index(), decoder.byte());
  } else if (event == IrEvent::kLast) {
    is_complete = true;
    OCR1A = static_cast<uint16_t>(TCNT1 + kSoonCycles);
  } else {
    listen_for_leader();
    is_garbled = true;
    wake_up();
  }
}

/// The message has ended: whole (called right behind the last pulse), or by silence.
ISR(TIMER1_COMPA_vect) {
  listen_for_leader();
  if (!is_complete) return;
  is_complete = false;
  if (decoder.is_intact()) {
    finish();
  } else {
    is_garbled = true;
  }
  wake_up();
}

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

bool is_receiving() {
  return is_timing();
}

const IrReception* next_reception() {
  return oldest == receiving ? nullptr : &ring[oldest];
}

void drop_reception() {
  oldest = static_cast<uint8_t>((oldest + 1) % kSlots);
}

bool take_garbled() {
  const bool was_garbled = is_garbled;
  is_garbled = false;
  return was_garbled;
}

uint16_t receptions_lost() {
  uint16_t count;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    count = lost_count;
  }
  return count;
}

}  // namespace kilobot
}  // namespace swarmtalk
