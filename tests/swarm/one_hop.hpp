// One hop: every robot publishes without pause. Counts what arrives whole, what was possible from
// the packets that physically arrived, and what arrives spliced.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "tests/swarm/best_policy.hpp"
#include "tests/swarm/swarm.hpp"

namespace swarmtalk::core::testing {

struct OneHopConfig {
  uint32_t side = 6;   // side * side robots on a grid of step 1
  double range = 1.5;  // 1.5: 6.1 neighbours of 36; 3.0: 20.3
  double loss = 0;
  uint8_t packets = 1;  // per message
  double seconds = 400;
  uint64_t seed = 1;
  bool distinct_ids = true;
  uint32_t clock_start = 0;
};

struct OneHopResult {
  double neighbours = 0;
  uint64_t intended = 0;  // (message, neighbour) pairs
  uint64_t possible = 0;  // of these, all packets arrived
  uint64_t intact = 0;
  uint64_t spliced = 0;
  uint64_t duplicates = 0;
  uint64_t greedy = 0;  // what ideal receivers with the same memory complete
  uint64_t forecast = 0;
  uint64_t bound() const { return greedy > forecast ? greedy : forecast; }
};

template <class P>
class OneHop {
 public:
  explicit OneHop(const OneHopConfig& config)
      : config_(config), swarm_(medium(config), config.seed) {
    const uint32_t count = config.side * config.side;
    senders_.resize(count);
    for (uint32_t i = 0; i < count; ++i) {
      auto& robot = swarm_.add(i % config.side, i / config.side);
      if (config.distinct_ids) robot.node.set_node_id(static_cast<typename Wire<P>::NodeId>(i + 1));
    }
    greedy_.assign(count, {IdealReceiver::Policy::kGreedy, P::kFragmentSlots, config.packets});
    forecast_.assign(count, {IdealReceiver::Policy::kForecast, P::kFragmentSlots, config.packets});
    swarm_.connect();
    for (uint32_t i = 0; i < count; ++i) start(i);
    swarm_.on_transmit = [this](uint32_t from, const uint8_t* packet, uint16_t) {
      sequence_ = Wire<P>::decode(packet).sequence;
      if (sequence_ == 0) ++senders_[from].on_air;
    };
    swarm_.on_arrive = [this](uint32_t to, uint32_t from, const uint8_t*, uint16_t) {
      Progress& progress = senders_[from].arrived[to];
      const uint32_t number = senders_[from].on_air;
      if (progress.number != number) progress = {number, 0};
      if (++progress.packets == config_.packets) ++result_.possible;
      result_.greedy += greedy_[to].hear(from, number, sequence_);
      result_.forecast += forecast_[to].hear(from, number, sequence_);
    };
  }

  OneHopResult run() {
    swarm_.run_until(static_cast<uint64_t>(config_.seconds * 1e6));
    result_.neighbours = swarm_.disk().mean_neighbours();
    return result_;
  }
  Swarm<P>& swarm() { return swarm_; }

 private:
  static constexpr uint16_t kBlock = 5;
  struct Progress {
    uint32_t number = 0;
    uint32_t packets = 0;
  };
  struct Sender {
    OneHop* scenario = nullptr;
    uint32_t index = 0;
    Publisher<P>* publisher = nullptr;
    uint32_t next = 0;                            // number of the message handed over last
    uint32_t on_air = 0;                          // number of the message whose packets leave now
    std::map<uint32_t, Progress> arrived;         // by receiver
    std::map<uint32_t, uint32_t> last_delivered;  // by sender
  };

  static MediumConfig medium(const OneHopConfig& config) {
    MediumConfig medium;
    medium.range = config.range;
    medium.loss = config.loss;
    medium.clock_start = config.clock_start;
    return medium;
  }

  void start(uint32_t i) {
    Sender& sender = senders_[i];
    sender.scenario = this;
    sender.index = i;
    Channel<P>* channel = swarm_.robot(i).node.new_channel(0, 0, false);
    sender.publisher = channel->new_publisher(&OneHop::on_sent, &sender);
    channel->new_subscriber(32000, &OneHop::on_message, &sender);
    publish(sender);
  }
  static void on_sent(void* self) {
    Sender& sender = *static_cast<Sender*>(self);
    sender.scenario->result_.intended +=
        sender.scenario->swarm_.disk().neighbours(sender.index).size();
    publish(sender);
  }
  static void publish(Sender& sender) {
    ++sender.next;
    uint8_t message[kBlock * 32];
    for (uint16_t block = 0; block < sender.scenario->config_.packets; ++block) {
      uint8_t* to = message + block * kBlock;
      to[0] = static_cast<uint8_t>(sender.index);
      to[1] = static_cast<uint8_t>(sender.next >> 16);
      to[2] = static_cast<uint8_t>(sender.next >> 8);
      to[3] = static_cast<uint8_t>(sender.next);
      to[4] = static_cast<uint8_t>(block);
    }
    sender.publisher->send(message,
                           static_cast<uint16_t>(sender.scenario->config_.packets * kBlock));
  }
  static void on_message(void* self, const uint8_t* bytes, uint16_t size, const Reception<P>&) {
    Sender& receiver = *static_cast<Sender*>(self);
    OneHopResult& result = receiver.scenario->result_;
    bool whole = size == receiver.scenario->config_.packets * kBlock;
    for (uint16_t block = 0; block * kBlock < size; ++block) {
      const uint8_t* at = bytes + block * kBlock;
      for (int i = 0; i < 4; ++i) whole = whole && at[i] == bytes[i];
      whole = whole && at[4] == block;
    }
    if (!whole) {
      ++result.spliced;
      return;
    }
    const uint32_t number = static_cast<uint32_t>(bytes[1] << 16 | bytes[2] << 8 | bytes[3]);
    uint32_t& last = receiver.last_delivered[bytes[0]];
    if (last == number) {
      ++result.duplicates;
    } else {
      ++result.intact;
    }
    last = number;
  }

  OneHopConfig config_;
  Swarm<P> swarm_;
  std::vector<Sender> senders_;
  std::vector<IdealReceiver> greedy_;
  std::vector<IdealReceiver> forecast_;
  uint16_t sequence_ = 0;  // of the packet in the air
  OneHopResult result_;
};

}  // namespace swarmtalk::core::testing
