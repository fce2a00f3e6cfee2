// What the cycle search and its image tell each other: a few bytes in the memory of the emulated
// ATmega328P. The host writes a command while the image waits; the image answers in place. Both
// compilers lay this out alike: little-endian, widest members first.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace avr {

enum class Command : uint8_t { kNone, kStart, kHear, kPull, kSend };

/// A channel as it is opened, with a publisher and a subscriber.
struct ChannelSetting {
  uint8_t id;
  uint8_t ttl;
};

struct Mailbox {
  uint32_t ticks;     // the node's clock, moved on by the host
  uint32_t random;    // state of its random numbers
  uint16_t counters;  // address of the node's counters, told at the start
  int16_t distance;   // of a packet heard
  Command command;
  uint8_t size;        // of a message to send
  uint8_t channel;     // that it goes out on: 0 or 1, in the order of opening
  uint8_t ttl;         // of that message
  uint8_t fixed_id;    // at the start: the node's id, or kDrawnId
  uint8_t own_id;      // the node's id, once a message of its own has left; kDrawnId before
  uint8_t result;      // bytes pulled, or the Error of a call
  uint8_t packet[9];   // heard or pulled
  uint8_t message[2];  // first and further bytes of a message to send
  ChannelSetting channels[2];
};
constexpr uint8_t kDrawnId = 255;

// Registers that the image writes and the host watches, as data space addresses.
constexpr uint16_t kMailboxAddressRegister = 0x3E;  // GPIOR0: low byte, then high byte
constexpr uint16_t kBracketRegister = 0x4A;         // GPIOR1: 1 before a measured call, 0 after it
constexpr uint16_t kReadyRegister = 0x4B;           // GPIOR2: the next command may be written

}  // namespace avr
}  // namespace swarmtalk
