// One message between two fresh nodes of profile P, over a third if it may be forwarded: it arrives
// once, with the bytes, the delay and the hops it has to have. Used by core_node_driver.hpp.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::core::fuzz {

inline void require(bool holds) {
  if (!holds) abort();
}

template <class P>
class Exchange {
 public:
  /// What is sent, and how its packets come.
  struct Plan {
    uint16_t size;  // up to the longest
    bool timestamped;
    uint8_t ttl;
    uint8_t waited;   // ticks until its packets are pulled
    uint8_t first;    // the packet that comes first, the others after it in a circle...
    bool is_reverse;  // ... or before it
  };

  /// @param now  the clock of all, set to what the plan says
  Exchange(uint32_t& now, uint32_t& draws) : now_(now), draws_(draws) {}

  void run(Plan plan) {
    const uint8_t channel = channel_for(plan.timestamped);
    const bool is_forwarded = plan.ttl != 0;
    auto sender = node(channel, plan, nullptr);
    auto receiver = node(channel, plan, &Exchange::on_message);
    auto forwarder = std::make_unique<Swarmtalk<P>>(port());
    if (sender->channel == nullptr) return;
    const uint16_t longest = sender->channel->max_message_bytes();
    const uint16_t least = P::kPadded ? 1 : 0;
    plan.size = std::max<uint16_t>(least, static_cast<uint16_t>(plan.size % (longest + 1u)));
    for (uint16_t i = 0; i < plan.size; ++i) sent_.push_back(static_cast<uint8_t>(i * 7 + i / 256));
    require(sender->publisher->send(sent_.data(), plan.size) == Error::kOk);
    now_ += plan.waited;
    std::vector<std::vector<uint8_t>> packets;
    while (sender->node.has_packet()) packets.push_back(pull(sender->node));
    require(packets.size() == std::max<size_t>(1, packets_for(plan)));
    if (packets.size() - 1 > P::kFragmentSlots) return;
    const size_t count = packets.size();
    for (size_t n = 0; n < count; ++n) {
      const size_t step = plan.is_reverse ? count - n : n;
      std::vector<uint8_t>& packet = packets[(plan.first + step) % count];
      if (is_forwarded) {
        require(hear(*forwarder, packet) == Error::kOk);
        packet = pull(*forwarder);
        while (forwarder->has_packet()) pull(*forwarder);  // repeats
      }
      require(!packet.empty() && hear(receiver->node, packet) == Error::kOk);
      require(received_ == (n + 1 == count ? 1 : 0));
    }
    check(plan, is_forwarded);
  }

 private:
  using W = Wire<P>;
  struct Node {
    Swarmtalk<P> node;
    Channel<P>* channel;
    Publisher<P>* publisher;
  };

  Port port() {
    return Port{[](void* self) { return static_cast<Exchange*>(self)->now_; },
                [](void* self) { return ++static_cast<Exchange*>(self)->draws_; }, this};
  }
  static uint8_t channel_for(bool& timestamped) {
    if (P::kTimestampBits == 0) timestamped = false;
    if (P::kTimestampedFrom == kNoTimestampedChannels) return 1;
    return static_cast<uint8_t>(timestamped ? P::kTimestampedFrom : 0);
  }
  std::unique_ptr<Node> node(uint8_t channel, const Plan& plan, ReceiveFn<P> receive) {
    std::unique_ptr<Node> node(new Node{Swarmtalk<P>(port()), nullptr, nullptr});
    // Two ids have to differ: where there is only one id, one channel's owner takes none.
    node->node.set_node_id(static_cast<typename W::NodeId>(receive == nullptr ? 0 : 1));
    node->channel = node->node.new_channel(channel, plan.ttl, plan.timestamped);
    if (node->channel == nullptr) return node;
    if (receive != nullptr) node->channel->new_subscriber(1, receive, this);
    node->publisher = node->channel->new_publisher(nullptr, nullptr);
    return node;
  }
  static size_t packets_for(const Plan& plan) {
    const size_t payload = plan.timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes;
    return (plan.size + payload - 1) / payload;
  }
  static std::vector<uint8_t> pull(Swarmtalk<P>& node) {
    std::vector<uint8_t> packet(W::kMtuBytes);
    packet.resize(node.pull_packet(packet.data()));
    return packet;
  }
  static Error hear(Swarmtalk<P>& node, const std::vector<uint8_t>& packet) {
    return node.on_packet(packet.data(), static_cast<uint16_t>(packet.size()),
                          typename P::Sensing{});
  }
  static void on_message(void* self, const uint8_t* bytes, uint16_t size,
                         const Reception<P>& reception) {
    static_cast<Exchange*>(self)->take(bytes, size, reception);
  }
  void take(const uint8_t* bytes, uint16_t size, const Reception<P>& reception) {
    ++received_;
    heard_.assign(bytes, bytes + size);
    delay_ticks_ = reception.delay_ticks;
    hops_ = reception.hops;
    has_delay_ = reception.has_delay;
  }

  void check(const Plan& plan, bool is_forwarded) {
    if (P::kPadded) {
      require(heard_.size() >= sent_.size());
      for (size_t i = sent_.size(); i < heard_.size(); ++i) require(heard_[i] == 0);
      heard_.resize(sent_.size());
    }
    require(heard_ == sent_);
    require(has_delay_ == plan.timestamped);
    if (plan.timestamped) {
      require(delay_ticks_ == std::min<uint32_t>(plan.waited, W::kTimestampMax));
    }
    if (P::kHopsBits != 0 || P::kHopsFromTtl) {
      require(hops_ == (is_forwarded ? 1 : 0));
    }
  }

  uint32_t& now_;
  uint32_t& draws_;
  std::vector<uint8_t> sent_;
  std::vector<uint8_t> heard_;
  int received_ = 0;
  uint32_t delay_ticks_ = 0;
  uint8_t hops_ = 0;
  bool has_delay_ = false;
};

}  // namespace swarmtalk::core::fuzz
