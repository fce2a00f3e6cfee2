// A node with the Kilobot's profile on an emulated ATmega328P, which does what the host writes into
// its mailbox: hears a packet, pulls one, sends a message. The calls that are measured stand
// between two writes to GPIOR1; the host (emulated_node.cpp) counts the cycles between.
#include <avr/io.h>
#include <string.h>

#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/swarmtalk.hpp"
#include "tests/avr/mailbox.hpp"

namespace {

using namespace swarmtalk;
using Profile = core::Kilobot;

volatile avr::Mailbox mailbox;

uint32_t clock_ticks(void*) {
  return mailbox.ticks;
}
uint32_t draw(void*) {  // as cheap as can be: it counts as the platform's, not as the library's
  mailbox.random = mailbox.random + UINT32_C(0x9E3779B9);
  return mailbox.random >> 16;
}

core::Swarmtalk<Profile> node(core::Port{&clock_ticks, &draw, nullptr});
core::Publisher<Profile>* publishers[2];
uint8_t packet[core::Wire<Profile>::kMtuBytes];
volatile uint8_t sink;
volatile bool has_sent;  // so node_id() draws none

void on_message(void*, const uint8_t* bytes, uint16_t, const core::Reception<Profile>&) {
  sink = bytes[0];
}
void on_sent(void*) {
  has_sent = true;
}

void start() {
  const uint8_t id = mailbox.fixed_id;
  if (id != avr::kDrawnId) {
    node.set_node_id(id);
    has_sent = true;
  }
  for (uint8_t i = 0; i < 2; ++i) {
    const uint8_t number = mailbox.channels[i].id;
    core::Channel<Profile>* const channel =
        node.new_channel(number, mailbox.channels[i].ttl, number >= Profile::kTimestampedFrom);
    publishers[i] = channel->new_publisher(&on_sent, nullptr);
    channel->new_subscriber(100, &on_message, nullptr);
  }
}

void hear() {
  for (uint8_t i = 0; i < sizeof packet; ++i) packet[i] = mailbox.packet[i];
  const core::DistanceSensing sensing{mailbox.distance};
  GPIOR1 = 1;
  const core::Error error = node.on_packet(packet, sizeof packet, sensing);
  GPIOR1 = 0;
  mailbox.result = static_cast<uint8_t>(error);
}

void pull() {
  GPIOR1 = 1;
  const uint8_t size = static_cast<uint8_t>(node.pull_packet(packet));
  GPIOR1 = 0;
  mailbox.result = size;
  for (uint8_t i = 0; i < sizeof packet; ++i) mailbox.packet[i] = packet[i];
}

void send() {
  uint8_t message[core::Wire<Profile>::kMessageBytes];
  memset(message, mailbox.message[1], sizeof message);
  message[0] = mailbox.message[0];
  mailbox.result = static_cast<uint8_t>(
      publishers[mailbox.channel]->send(message, mailbox.size, mailbox.ttl, false));
}

}  // namespace

int main() {
  const uint16_t address = reinterpret_cast<uint16_t>(&mailbox);
  GPIOR0 = static_cast<uint8_t>(address);
  GPIOR0 = static_cast<uint8_t>(address >> 8);
  mailbox.counters = reinterpret_cast<uint16_t>(&node.counters());
  for (;;) {
    mailbox.own_id = has_sent ? node.node_id() : avr::kDrawnId;
    GPIOR2 = 1;
    switch (mailbox.command) {
      case avr::Command::kStart:
        start();
        break;
      case avr::Command::kHear:
        hear();
        break;
      case avr::Command::kPull:
        pull();
        break;
      case avr::Command::kSend:
        send();
        break;
      case avr::Command::kNone:
        break;
    }
  }
}
