// A flood into a swarm whose robots all hear each other and may send a few frames a second each: a
// stranger fills the air for some seconds with messages that ask to be sent on. How long do the
// robots go on, and how often does one send one message? Frames hold as many packets as fit, as the
// daemon's links fill them. Virtual time, from a seed.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <queue>
#include <random>
#include <unordered_map>
#include <vector>

#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::core::testing {

struct RateFloodConfig {
  uint32_t robots = 40;
  double rate_hz = 3;   // frames of each robot
  double flood_s = 10;  // of the stranger
  double flood_bytes_hz = 120e3;
  uint16_t payload_bytes = 100;  // of each message
  uint8_t ttl = 255;
  double loss = 0.05;  // of frames
  uint8_t max_ttl = 16;
  uint32_t max_wait_us = 5'000'000;  // 0: no limits
  double give_up_s = 1200;
  uint64_t seed = 1;
};

struct RateFloodResult {
  uint32_t messages = 0;      // of the stranger
  double once_each_s = 0;     // what it takes a robot to send each once
  double over_s = 0;          // the last packet that was sent on, after the flood's beginning
  uint32_t most_repeats = 0;  // of one message by one robot
  uint64_t frames = 0;        // of the robots
};

template <class P>
class RateFlood {
 public:
  explicit RateFlood(const RateFloodConfig& config) : config_(config), draws_(config.seed) {
    for (uint32_t i = 0; i < config.robots; ++i) {
      robots_.push_back(std::make_unique<Robot>(*this));
      Robot& robot = *robots_.back();
      robot.node.set_node_id(static_cast<uint16_t>(i + 1));
      robot.node.set_epoch(static_cast<uint16_t>(draws_()));
      if (config.max_wait_us != 0) {
        robot.node.limit_forwarding(config.max_ttl, config.max_wait_us);
      }
      turns_.push({uniform() / config.rate_hz, i});
    }
  }

  RateFloodResult run() {
    const uint16_t packet_bytes =
        static_cast<uint16_t>(Wire<P>::kHeaderBytes + config_.payload_bytes);
    const uint32_t per_frame = kFrameBytes / (packet_bytes + 2u);
    const double interval_s = per_frame * packet_bytes / config_.flood_bytes_hz;
    double next_s = 0;
    while (true) {
      const bool floods = next_s < config_.flood_s;
      if (floods && next_s <= turns_.top().at_s) {
        now_s_ = next_s;
        shout(per_frame, packet_bytes);
        next_s += interval_s;
        continue;
      }
      const Turn turn = turns_.top();
      now_s_ = turn.at_s;
      const bool is_silent = now_s_ > config_.flood_s &&
                             now_s_ > result_.over_s + 3 / config_.rate_hz &&
                             std::none_of(robots_.begin(), robots_.end(),
                                          [](const auto& each) { return each->node.has_packet(); });
      if (is_silent || now_s_ > config_.give_up_s) break;
      turns_.pop();
      speak(*robots_[turn.robot]);
      turns_.push({turn.at_s + 1 / config_.rate_hz, turn.robot});
    }
    result_.once_each_s = static_cast<double>(result_.messages) / per_frame / config_.rate_hz;
    return result_;
  }

 private:
  static constexpr uint32_t kFrameBytes = 1480;

  struct Robot {
    explicit Robot(RateFlood& flood) : node(Port{&RateFlood::clock, &RateFlood::draw, &flood}) {}
    Swarmtalk<P> node;
    std::unordered_map<uint32_t, uint32_t> sent;  // message, how often
  };
  struct Turn {
    double at_s;
    uint32_t robot;
    bool operator<(const Turn& other) const { return at_s > other.at_s; }
  };

  static uint32_t clock(void* self) {
    return static_cast<uint32_t>(
        static_cast<uint64_t>(static_cast<RateFlood*>(self)->now_s_ * 1e6));
  }
  static uint32_t draw(void* self) {
    return static_cast<uint32_t>(static_cast<RateFlood*>(self)->draws_());
  }
  double uniform() { return static_cast<double>(draws_() >> 11) / 9007199254740992.0; }

  void shout(uint32_t packets, uint16_t packet_bytes) {
    std::vector<std::vector<uint8_t>> frame(packets, std::vector<uint8_t>(packet_bytes));
    for (auto& packet : frame) {
      typename Wire<P>::Header header{};
      header.node = 60000;
      header.message = ++result_.messages;
      header.end = true;
      header.channel = 5;
      header.ttl = config_.ttl;
      header.size = config_.payload_bytes;
      Wire<P>::encode(header, packet.data());
    }
    for (auto& robot : robots_) hear(*robot, frame);
  }

  void speak(Robot& robot) {
    std::vector<std::vector<uint8_t>> frame;
    uint32_t used = 0;
    uint8_t packet[P::kMtuBytes];
    while (true) {
      robot.node.drop_late_forwards();
      const uint16_t next = robot.node.next_packet_bytes();
      if (next == 0 || used + next + 2 > kFrameBytes) break;
      const uint16_t size = robot.node.pull_packet(packet);
      used += size + 2u;
      frame.emplace_back(packet, packet + size);
      const uint32_t message = Wire<P>::decode(packet).message;
      result_.most_repeats = std::max(result_.most_repeats, ++robot.sent[message]);
    }
    if (frame.empty()) return;
    ++result_.frames;
    result_.over_s = now_s_;
    for (auto& other : robots_) {
      if (other.get() != &robot) hear(*other, frame);
    }
  }

  void hear(Robot& robot, const std::vector<std::vector<uint8_t>>& frame) {
    if (uniform() < config_.loss) return;
    typename P::Sensing sensing{};
    for (const auto& packet : frame) {
      robot.node.on_packet(packet.data(), static_cast<uint16_t>(packet.size()), sensing);
    }
  }

  RateFloodConfig config_;
  std::mt19937_64 draws_;
  double now_s_ = 0;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::priority_queue<Turn> turns_;
  RateFloodResult result_;
};

}  // namespace swarmtalk::core::testing
