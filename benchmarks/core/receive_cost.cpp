// Work for callgrind: receives `packets` packets in one of several situations, built beforehand, so
// that the difference between two run lengths is the cost of receiving alone.
//   receive_cost SITUATION PACKETS     prints how many messages were delivered
// Situations: idle, send1, send8 (pull_packet); kilobot1, kilobot8 (the Kilobot's own memory);
// single, eight, senders2, senders100, full3000 (memory for all: hash table, 4000 fragments).
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace {

using namespace swarmtalk::core;

/// The paper's nine bytes with sum-8, and memory for thousands of packets.
struct Large : Kilobot {
  static constexpr uint16_t kFragmentSlots = 4000;
  static constexpr uint16_t kRecords = 4096;
  static constexpr uint16_t kBuckets = 4096;
  static constexpr uint32_t kAssemblyTicks = 30000;
  static constexpr uint8_t kStampBits = 16;
  static constexpr uint8_t kClosedShift = 0;
  static constexpr uint32_t kBufferBudgetBytes = 1u << 20;
};

uint32_t ticks = 1000;
uint64_t delivered = 0;
Port port() {
  return Port{[](void*) { return ticks; }, [](void*) { return 4u; }, nullptr};
}

using Packet = std::vector<uint8_t>;

/// One round of packets: each sender's message, the senders interleaved packet by packet.
template <class P>
std::vector<Packet> round_of(uint32_t senders, uint32_t packets, uint32_t number) {
  std::vector<std::vector<Packet>> by_sender(senders);
  for (uint32_t sender = 0; sender < senders; ++sender) {
    auto node = std::make_unique<Swarmtalk<P>>(port());
    node->set_node_id(static_cast<uint8_t>(sender + 1));
    auto* publisher = node->new_channel(0, 0, false)->new_publisher(nullptr, nullptr);
    for (uint32_t skipped = 0; skipped <= number; ++skipped) {
      std::vector<uint8_t> message(packets * 5, static_cast<uint8_t>(sender));
      publisher->send(message.data(), static_cast<uint16_t>(message.size()));
      by_sender[sender].clear();
      while (node->has_packet()) {
        Packet packet(P::kMtuBytes);
        node->pull_packet(packet.data());
        by_sender[sender].push_back(packet);
      }
    }
  }
  std::vector<Packet> round;
  for (uint32_t n = 0; n < packets; ++n) {
    for (auto& sent : by_sender) round.push_back(sent[n]);
  }
  return round;
}

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
    std::vector<std::vector<Packet>> rounds;
    for (uint32_t number = 0; number < 16; ++number) {
      rounds.push_back(round_of<P>(senders, length, number));
    }
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

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::string situation = argv[1];
  const auto packets = static_cast<uint32_t>(std::atoi(argv[2]));
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
