// A node with a clock and a random generator that the test sets, and a subscriber that remembers.
#pragma once

#include <cstdint>
#include <vector>

#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::core::testing {

using Bytes = std::vector<uint8_t>;

struct TestPort {
  uint32_t now = 0;
  uint32_t next_random = 7;
  static uint32_t clock(void* self) { return static_cast<TestPort*>(self)->now; }
  static uint32_t random(void* self) { return static_cast<TestPort*>(self)->next_random++; }
  Port port() { return Port{&TestPort::clock, &TestPort::random, this}; }
};

template <class P>
struct Received {
  Bytes bytes;
  Reception<P> reception;
};

template <class P>
class TestNode {
 public:
  explicit TestNode(uint16_t id) : node(port.port()) {
    node.set_node_id(static_cast<typename Wire<P>::NodeId>(id));
  }
  TestNode() : node(port.port()) {}

  Channel<P>* open(uint32_t id, uint32_t ttl = 0, bool timestamped = false) {
    Channel<P>* channel = node.new_channel(id, ttl, timestamped);
    if (channel == nullptr) return nullptr;
    publisher =
        channel->new_publisher([](void* self) { ++static_cast<TestNode*>(self)->sent; }, this);
    channel->new_subscriber(
        100,
        [](void* self, const uint8_t* bytes, uint16_t size, const Reception<P>& reception) {
          static_cast<TestNode*>(self)->received.push_back({Bytes(bytes, bytes + size), reception});
        },
        this);
    return channel;
  }
  Bytes pull() {
    Bytes packet(Wire<P>::kMtuBytes);
    packet.resize(node.pull_packet(packet.data()));
    return packet;
  }
  std::vector<Bytes> pull_all() {
    std::vector<Bytes> packets;
    while (node.has_packet()) packets.push_back(pull());
    return packets;
  }
  Error hear(const Bytes& packet, typename P::Sensing sensing = typename P::Sensing{}) {
    return node.on_packet(packet.data(), static_cast<uint16_t>(packet.size()), sensing);
  }

  TestPort port;
  Swarmtalk<P> node;
  Publisher<P>* publisher = nullptr;  // of the channel opened last
  std::vector<Received<P>> received;
  int sent = 0;
};

inline Bytes pattern(size_t size, uint8_t seed = 1) {
  Bytes bytes(size);
  for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<uint8_t>(seed + i * 7 + i / 256);
  return bytes;
}

}  // namespace swarmtalk::core::testing
