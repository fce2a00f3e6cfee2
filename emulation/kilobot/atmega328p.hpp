// Data-space addresses, bits and vectors of the ATmega328P that the emulator looks at.
// Source: Microchip DS40002061, register summary and interrupt vectors.
#pragma once

#include <cstdint>

namespace swarmtalk::emulator::atmega328p {

inline constexpr std::uint16_t kDdrB = 0x24, kPortB = 0x25;
inline constexpr std::uint16_t kDdrC = 0x27, kPortC = 0x28;
inline constexpr std::uint16_t kDdrD = 0x2A, kPortD = 0x2B;
inline constexpr std::uint16_t kAcsr = 0x50, kSmcr = 0x53, kMcucr = 0x55, kSpmcsr = 0x57;
inline constexpr std::uint16_t kAdcsra = 0x7A, kAdcsrb = 0x7B;
inline constexpr std::uint16_t kTccr2a = 0xB0, kTccr2b = 0xB1, kOcr2a = 0xB3, kOcr2b = 0xB4;
inline constexpr std::uint16_t kUcsr0a = 0xC0, kUcsr0c = 0xC2, kUbrr0l = 0xC4, kUbrr0h = 0xC5;

inline constexpr std::uint8_t kAci = 1 << 4, kAco = 1 << 5;                       // ACSR
inline constexpr std::uint8_t kAden = 1 << 7, kAdate = 1 << 5;                    // ADCSRA
inline constexpr std::uint8_t kAdtsMask = 7, kAdtsComparator = 1;                 // ADCSRB
inline constexpr std::uint8_t kIvsel = 1 << 1;                                    // MCUCR
inline constexpr std::uint8_t kSelfprgen = 1, kPgers = 1 << 1, kPgwrt = 1 << 2;   // SPMCSR
inline constexpr std::uint8_t kSleepModeMask = 7 << 1, kSleepPowerDown = 2 << 1;  // SMCR
inline constexpr std::uint8_t kCom2a1 = 1 << 7, kCom2b1 = 1 << 5;                 // TCCR2A
inline constexpr std::uint8_t kClock2Mask = 7;                                    // TCCR2B
inline constexpr std::uint8_t kU2x = 1 << 1;                                      // UCSR0A

inline constexpr std::uint8_t kVectorWatchdog = 6, kVectorComparator = 23, kVectorTwi = 24;
inline constexpr std::uint8_t kVectorLastPinChange = 5;  // INT0, INT1, PCINT0..2 are 1..5

inline constexpr unsigned kInterruptEntryCycles = 4;

inline constexpr std::uint16_t kRamStart = 0x100, kRamEnd = 0x8FF;

}  // namespace swarmtalk::emulator::atmega328p
