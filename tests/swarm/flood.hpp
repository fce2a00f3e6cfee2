// Floods: one robot in the corner, or all, publish now and then; every robot forwards. Counts
// coverage, copies delivered twice, splices, transmissions, and how true the reported delay is.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "tests/swarm/swarm.hpp"

namespace swarmtalk::core::testing {

struct FloodConfig {
  uint32_t side = 10;
  double range = 1.5;
  double loss = 0;
  uint8_t packets = 1;
  uint8_t ttl = 9;
  bool all_publish = false;  // else robot 0, in the corner
  double period_s = 120;     // between two messages of a robot
  double seconds = 2400;
  bool timestamped = false;
  uint64_t seed = 1;
  bool distinct_ids = true;
  uint32_t clock_start = 0;
};

struct FloodResult {
  uint64_t messages = 0;
  uint64_t intended = 0;  // (message, other robot) pairs
  uint64_t possible = 0;  // of these, all packets arrived somehow
  uint64_t delivered = 0;
  uint64_t duplicates = 0;
  uint64_t to_self = 0;
  uint64_t spliced = 0;
  uint64_t transmissions = 0;
  std::vector<double> delay_errors;  // ticks, reported minus true
  std::vector<uint8_t> hops;         // of each delivery

  double coverage() const { return static_cast<double>(delivered) / static_cast<double>(intended); }
  double reachable() const { return static_cast<double>(possible) / static_cast<double>(intended); }
  /// Transmissions per packet that every robot would send once.
  double cost(uint32_t robots, uint8_t packets) const {
    return static_cast<double>(transmissions) / (static_cast<double>(messages) * robots * packets);
  }
};

template <class P>
class Flood {
 public:
  explicit Flood(const FloodConfig& config) : config_(config), swarm_(medium(config), config.seed) {
    const uint32_t count = config.side * config.side;
    members_.resize(count);
    for (uint32_t i = 0; i < count; ++i) {
      auto& robot = swarm_.add(i % config.side, i / config.side);
      if (config.distinct_ids) robot.node.set_node_id(static_cast<typename Wire<P>::NodeId>(i + 1));
    }
    swarm_.connect();
    for (uint32_t i = 0; i < count; ++i) join(i);
    swarm_.on_transmit = [this](uint32_t, const uint8_t*, uint16_t) { ++result_.transmissions; };
    swarm_.on_arrive = [this](uint32_t to, uint32_t, const uint8_t* packet, uint16_t) {
      const uint8_t* block = packet + Wire<P>::kHeaderBytes;
      const uint32_t message =
          static_cast<uint32_t>(block[0] << 16 | block[1] << 8 | (block[2] & ~7));
      Heard& heard = members_[to].heard[(message >> 3 ^ message >> 16 << 7) % kRemembered];
      if (heard.message != message) heard = {message, 0};
      const uint32_t before = heard.packets;
      heard.packets |= 1u << (block[2] & 7);
      if (heard.packets != before && heard.packets == (1u << config_.packets) - 1u &&
          block[0] != to) {
        ++result_.possible;
      }
    };
  }

  FloodResult run() {
    const uint64_t end_us = static_cast<uint64_t>(config_.seconds * 1e6);
    const uint64_t period_us = static_cast<uint64_t>(config_.period_s * 1e6);
    const uint32_t publishers = config_.all_publish ? swarm_.size() : 1;
    // Robots take turns within a period, and the last period is left for the floods to end.
    const uint64_t step_us = period_us / publishers;
    for (uint64_t at_us = step_us, turn = 0; at_us + period_us <= end_us;
         at_us += step_us, ++turn) {
      swarm_.run_until(at_us);
      publish(static_cast<uint32_t>(turn % publishers));
    }
    swarm_.run_until(end_us);
    return result_;
  }
  Swarm<P>& swarm() { return swarm_; }

 private:
  static constexpr uint32_t kRemembered = 8192;
  struct Heard {
    uint32_t message = UINT32_MAX;
    uint32_t packets = 0;
  };
  struct Member {
    Flood* scenario = nullptr;
    uint32_t index = 0;
    Publisher<P>* publisher = nullptr;
    uint32_t number = 0;
    std::vector<uint64_t> sent_us;  // by number
    std::set<uint32_t> delivered;   // source << 16 | number
    std::vector<Heard> heard = std::vector<Heard>(kRemembered);
  };

  static MediumConfig medium(const FloodConfig& config) {
    MediumConfig medium;
    medium.range = config.range;
    medium.loss = config.loss;
    medium.clock_start = config.clock_start;
    return medium;
  }
  uint16_t block_bytes() const {
    return config_.timestamped ? Wire<P>::kTimedPayloadBytes : Wire<P>::kPayloadBytes;
  }

  void join(uint32_t i) {
    Member& member = members_[i];
    member.scenario = this;
    member.index = i;
    Channel<P>* channel = swarm_.robot(i).node.new_channel(config_.timestamped ? 8 : 0, config_.ttl,
                                                           config_.timestamped);
    member.publisher = channel->new_publisher(nullptr, nullptr);
    channel->new_subscriber(32000, &Flood::on_message, &member);
  }

  /// Each packet's payload begins with source, number (13 bits) and its own index (3 bits).
  void publish(uint32_t i) {
    Member& member = members_[i];
    uint8_t message[64] = {};
    const uint16_t block = block_bytes();
    for (uint8_t n = 0; n < config_.packets; ++n) {
      message[n * block] = static_cast<uint8_t>(i);
      message[n * block + 1] = static_cast<uint8_t>(member.number >> 5);
      message[n * block + 2] = static_cast<uint8_t>(member.number << 3 | n);
    }
    if (member.publisher->send(message, static_cast<uint16_t>(block * config_.packets)) !=
        Error::kOk) {
      return;
    }
    ++member.number;
    member.sent_us.push_back(swarm_.now_us());
    ++result_.messages;
    result_.intended += swarm_.size() - 1;
  }

  static void on_message(void* self, const uint8_t* bytes, uint16_t size,
                         const Reception<P>& reception) {
    Member& member = *static_cast<Member*>(self);
    Flood& scenario = *member.scenario;
    FloodResult& result = scenario.result_;
    const uint16_t block = scenario.block_bytes();
    bool whole = size == block * scenario.config_.packets;
    for (uint16_t n = 0; n * block < size; ++n) {
      const uint8_t* at = bytes + n * block;
      whole = whole && at[0] == bytes[0] && at[1] == bytes[1] &&
              at[2] == static_cast<uint8_t>((bytes[2] & ~7) | n);
    }
    if (!whole) {
      ++result.spliced;
      return;
    }
    const uint32_t source = bytes[0];
    const uint32_t number = static_cast<uint32_t>(bytes[1] << 5 | bytes[2] >> 3);
    if (source == member.index) {
      ++result.to_self;
      return;
    }
    if (!member.delivered.insert(source << 16 | number).second) {
      ++result.duplicates;
      return;
    }
    ++result.delivered;
    result.hops.push_back(reception.hops);
    if (reception.has_delay) {
      const uint64_t true_us =
          scenario.swarm_.now_us() - scenario.members_[source].sent_us.at(number);
      result.delay_errors.push_back(static_cast<double>(reception.delay_ticks) -
                                    static_cast<double>(true_us) / 32'000.0);
    }
  }

  FloodConfig config_;
  Swarm<P> swarm_;
  std::vector<Member> members_;
  FloodResult result_;
};

}  // namespace swarmtalk::core::testing
