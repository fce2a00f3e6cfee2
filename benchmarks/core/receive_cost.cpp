// Work for callgrind: receives `packets` packets in one of several situations, built beforehand, so
// that the difference between two run lengths is the cost of receiving alone.
//   receive_cost SITUATION[:SEED] PACKETS     prints how many messages were delivered
// Situations here: idle, send1, send8 (pull_packet); kilobot1, kilobot8 (the Kilobot's own memory);
// single, eight, senders2, senders100, full3000 (memory for all: hash table, 4000 fragments).
// Floods and copies are in flood_cost.cpp, the wifi profile in wifi_cost.cpp; the words for each
// are in core_table.py.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "benchmarks/core/measured_node.hpp"

namespace {

using namespace swarmtalk::core;
using namespace swarmtalk::core::cost;

struct Large : MemoryForAll {};  // local to this file: code for these situations alone

template <class P>
class Receiver {
 public:
  Receiver() : node_(std::make_unique<Swarmtalk<P>>(port())) {
    node_->set_node_id(250);
    node_->new_channel(0, 0, false)
        ->new_subscriber(
            100, [](void*, const uint8_t*, uint16_t, const Reception<P>&) { ++delivered; },
            nullptr);
  }

  /// Leaves `count` first packets of messages that never go on, from other senders.
  void fill(uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) {
      const uint32_t sender = 120 + i / 16 % 100;
      const uint32_t sequence = i / 1600;
      uint8_t packet[9] = {static_cast<uint8_t>(sender),
                           static_cast<uint8_t>((i % 16) << 4 | sequence << 1)};
      Wire<P>::seal(packet, 8);
      node_->on_packet(packet, 9, DistanceSensing{50});
    }
  }

  /// @param step  ticks that pass per round
  void receive(uint32_t packets, uint32_t senders, uint32_t length, uint32_t step) {
    const std::vector<Round> rounds = rounds_of<P>(16, senders, length * Wire<P>::kPayloadBytes, 0);
    Swarmtalk<P>& node = *node_;
    const DistanceSensing sensing{50};
    for (uint32_t received = 0, round = 0; received < packets; ++round) {
      for (const Packet& packet : rounds[round % 16]) {
        node.on_packet(packet.data(), 9, sensing);
        if (++received == packets) break;
      }
      ticks += step;
    }
  }

  void send(uint32_t packets, uint32_t length) {
    auto* publisher = node_->new_channel(1, 0, false)->new_publisher(nullptr, nullptr);
    const uint8_t message[40] = {};
    uint8_t packet[9];
    for (uint32_t sent = 0; sent < packets; ++sent) {
      if (length != 0 && publisher->available()) {
        publisher->send(message, static_cast<uint16_t>(length * 5));
      }
      node_->pull_packet(packet);
    }
  }

 private:
  std::unique_ptr<Swarmtalk<P>> node_;
};

constexpr const char* kHere[] = {"idle",   "send1", "send8",    "kilobot1",   "kilobot8",
                                 "single", "eight", "senders2", "senders100", "full3000"};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  std::string situation = argv[1];
  const size_t colon = situation.find(':');
  if (colon != std::string::npos) {
    random_state = std::strtoull(&situation[colon + 1], nullptr, 10);
    situation.resize(colon);
  }
  const auto packets = static_cast<uint32_t>(std::atoi(argv[2]));
  const auto is_here = [&](const char* name) { return situation == name; };
  if (std::none_of(std::begin(kHere), std::end(kHere), is_here)) {
    if (!run_flood(situation, packets) && !run_wifi(situation, packets)) return 2;
    std::printf("%llu\n", static_cast<unsigned long long>(delivered));
    return 0;
  }
  auto kilobot = std::make_unique<Receiver<Kilobot>>();
  auto large = std::make_unique<Receiver<Large>>();
  if (situation == "idle") kilobot->send(packets, 0);
  if (situation == "send1") kilobot->send(packets, 1);
  if (situation == "send8") kilobot->send(packets, 8);
  if (situation == "kilobot1") kilobot->receive(packets, 1, 1, 16);
  if (situation == "kilobot8") kilobot->receive(packets, 1, 8, 128);
  if (situation == "single") large->receive(packets, 1, 1, 16);
  if (situation == "eight") large->receive(packets, 1, 8, 128);
  if (situation == "senders2") large->receive(packets, 2, 8, 128);
  if (situation == "senders100") large->receive(packets, 100, 8, 128);
  if (situation == "full3000") {
    large->fill(3000);
    large->receive(packets, 1, 1, 16);
  }
  std::printf("%llu\n", static_cast<unsigned long long>(delivered));
  return 0;
}
