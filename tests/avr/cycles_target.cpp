// Runs the library's calls on an emulated ATmega328P and brackets each with writes to GPIOR1: the
// number of the situation, then 0. cycles.cpp counts the cycles between. The packets are made here.
#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <string.h>

#include "tests/avr/bare_robot.hpp"

namespace {

using namespace swarmtalk;
using Profile = core::Kilobot;
using W = core::Wire<Profile>;

uint16_t ticks = 100;
uint32_t clock_ticks(void*) {
  return ticks;
}
uint32_t draw(void*) {
  return 5;
}

core::Swarmtalk<Profile> node(core::Port{&clock_ticks, &draw, nullptr});
core::Publisher<Profile>* publisher;
uint8_t packet[9];
volatile uint8_t sink;

void on_message(void*, const uint8_t* bytes, uint16_t, const core::Reception<Profile>&) {
  sink = bytes[0];
}

void make(uint8_t from, uint8_t message, uint8_t sequence, bool end, uint8_t channel, uint8_t ttl) {
  packet[0] = from;
  packet[1] = static_cast<uint8_t>(message << 4 | sequence << 1 | (end ? 1 : 0));
  packet[2] = static_cast<uint8_t>(channel << 4 | ttl);
  memset(packet + 3, sequence, 5);
  W::seal(packet, 8);
}
void hear(uint8_t situation) {
  GPIOR1 = situation;
  node.on_packet(packet, 9, core::DistanceSensing{50});
  GPIOR1 = 0;
}
void pull(uint8_t situation) {
  GPIOR1 = situation;
  node.pull_packet(packet);
  GPIOR1 = 0;
}
void pass(uint16_t passed) {  // a robot's calls go on meanwhile
  for (uint16_t i = 0; i < passed; i += 16) {
    ticks += 16;
    pull(1);
  }
}

}  // namespace

int main() {
  node.set_node_id(250);
  core::Channel<Profile>* const one_hop = node.new_channel(0, 0, false);
  publisher = one_hop->new_publisher(nullptr, nullptr);
  one_hop->new_subscriber(100, &on_message, nullptr);
  node.new_channel(1, 5, false)->new_subscriber(100, &on_message, nullptr);
  uint8_t message[40];
  memset(message, 7, sizeof message);

  pull(1);
  publisher->send(message, 5);
  pull(2);
  publisher->send(message, 40);
  for (uint8_t i = 0; i < 8; ++i) pull(3);

  make(1, 1, 0, true, 1, 0);
  hear(4);
  make(2, 1, 0, true, 5, 3);  // a channel that is not ours, to be forwarded
  hear(5);
  pull(6);
  for (uint8_t i = 0; i < 8; ++i) {
    make(3, 1, i, i == 7, 1, 0);
    hear(i == 7 ? 7 : 8);
  }
  // Every slot and every record taken by unfinished messages of others.
  for (uint8_t from = 10; from < 30; ++from) {
    for (uint8_t i = 0; i < 2; ++i) {
      make(from, 2, i, false, 1, 0);
      hear(8);
    }
  }
  make(40, 1, 0, true, 1, 0);
  hear(9);
  make(41, 1, 0, false, 1, 0);
  hear(10);
  make(10, 2, 2, false, 1, 0);  // goes on with one begun: another has to go
  hear(11);
  pass(400);
  // A full forward queue, and a copy with more TTL of the packet that came last.
  for (uint8_t from = 50; from < 60; ++from) {
    make(from, 3, 0, true, 5, 3);
    hear(5);
  }
  make(59, 3, 0, true, 5, 9);
  hear(12);
  for (uint8_t from = 60; from < 80; ++from) {
    make(from, 3, 0, true, 1, 0);
    hear(9);
  }
  pass(400);
  // One-hop messages begun by many, most slots taken, and messages usually have 8 packets: whether
  // one more would become whole takes a look at each.
  for (uint8_t i = 0; i < 2; ++i) {
    make(80, 1, i, i == 1, 0, 0);
    hear(8);
  }
  for (uint8_t from = 81; from < 97; ++from) {
    for (uint8_t i = 0; i < 2; ++i) {
      make(from, 2, i, false, 0, 0);
      hear(8);
    }
  }
  for (uint8_t i = 0; i < 8; ++i) {
    make(97, 1, i, i == 7, 0, 0);
    hear(8);
  }
  make(98, 2, 0, false, 0, 0);
  hear(13);
  cli();
  sleep_mode();  // ends the emulation
}
