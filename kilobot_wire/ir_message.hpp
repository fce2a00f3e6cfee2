// One infrared message as Kilobots exchange it: nine bytes, a type and a checksum. Portable; used
// by the robot, the bootloader, the overhead controller and the tests.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

constexpr uint8_t kIrDataBytes = 9;
constexpr uint8_t kIrBodyBytes = 10;     // data and type: what the checksum covers
constexpr uint8_t kIrMessageBytes = 12;  // body and checksum, little-endian: what is on the air

/// Types of message. 0 to 0x5F belong to programs and are heard in every state of a robot.
enum IrType : uint8_t {
  kIrClassic2020 = 0x00,  // a packet of the Classic2020 profile (8 bytes); also kilolib's NORMAL
  kIrGps = 0x01,          // id, x, y, theta, sent by an overhead controller
  kIrSwarmtalk = 0x02,    // a packet of the Kilobot profile
  kIrSwarmtalkFromOverhead = 0x03,  // the same from an overhead controller: no distance
  // kIrSwarmtalk with a report: so many times kIrReportUnits before this message began, its sender
  // heard what it could not read (0 to kIrMostReport).
  kIrReports = 0x60,
  kIrFirstControl = 0x80,
  kIrBoot = 0x80,     // to the bootloader
  kIrPage = 0x81,     // bootloader only: page, word offset, 3 words
  kIrPages = 0x82,    // bootloader only: number of pages of the program
  kIrReset = 0x83,    // restart the program
  kIrSleep = 0x84,    // power down
  kIrWakeup = 0x85,   // pause: back to idle
  kIrCharge = 0x86,   // show whether the charger is at work
  kIrVoltage = 0x87,  // show the battery's voltage
  kIrRun = 0x88,      // run the program
  kIrReadUid = 0x89,  // show one bit of the uid by turning
  kIrCalibrate = 0x8A,
};

constexpr uint8_t kIrMostReport = 0x1F;
constexpr uint8_t kIrReportUnits = 32;  // of 128 us: 4.1 ms

/// Whether a message carries a packet of the Kilobot profile from a robot, with a report or not.
constexpr bool is_swarmtalk(uint8_t type) {
  return type == kIrSwarmtalk || static_cast<uint8_t>(type - kIrReports) <= kIrMostReport;
}

struct IrMessage {
  uint8_t data[kIrDataBytes];
  uint8_t type;
};
static_assert(sizeof(IrMessage) == kIrBodyBytes, "a message lies in memory as on the air");

constexpr uint16_t kIrCrcStart = 0xFFFF;

/// `byte` / 16. The compiler for AVR makes a loop of 16-bit shifts of it where it has the choice.
__attribute__((always_inline)) inline uint8_t upper_nibble(uint8_t byte) {
#if defined(__AVR__)
  __asm__("swap %0\n\tandi %0, 0x0F" : "+d"(byte));
  return byte;
#else
  return static_cast<uint8_t>(byte >> 4);
#endif
}

/// CRC-16/MCRF4XX, one byte: reflected polynomial 0x8408, no final XOR ("123456789" -> 0x6F91).
/// Over a message with its own CRC behind it (low byte first) the result is 0.
__attribute__((always_inline)) inline uint16_t ir_crc_step(uint16_t crc, uint8_t byte) {
  // The eight shifts of the polynomial folded into byte operations (x^16 + x^12 + x^5 + 1), each
  // half of the result by itself.
  uint8_t mixed = static_cast<uint8_t>(byte ^ crc);
  mixed = static_cast<uint8_t>(mixed ^ static_cast<uint8_t>(mixed << 4));
  const uint8_t upper = upper_nibble(mixed);
  const uint8_t low = static_cast<uint8_t>((crc >> 8) ^ upper ^ static_cast<uint8_t>(mixed << 3));
  const uint8_t high = static_cast<uint8_t>(mixed ^ static_cast<uint8_t>(upper >> 1));
  return static_cast<uint16_t>((static_cast<uint16_t>(high) << 8) | low);
}

/// The checksummed bytes of a message, kIrBodyBytes, one behind the other.
inline const uint8_t* ir_body(const IrMessage& message) {
  return reinterpret_cast<const uint8_t*>(&message);
}

/// Checksum of `message`, as it follows the type on the air (low byte first).
inline uint16_t ir_crc(const IrMessage& message) {
  uint16_t crc = kIrCrcStart;
  for (uint8_t i = 0; i < kIrBodyBytes; ++i) crc = ir_crc_step(crc, ir_body(message)[i]);
  return crc;
}

}  // namespace kilobot
}  // namespace swarmtalk
