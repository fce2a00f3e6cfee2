// A robot of a Scene whose node is the library's: the public interface only.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <random>

#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::core::testing {

/// A robot's clock: the scene's time at the robot's rate.
struct RobotClock {
  const double* now_ticks = nullptr;
  double rate = 1;
  uint32_t ticks() const { return static_cast<uint32_t>(static_cast<uint64_t>(*now_ticks * rate)); }
};

/// What a robot tells its scene.
struct RobotHooks {
  std::function<void(uint32_t robot, const uint8_t* bytes, uint16_t size)> message;
  std::function<void(uint32_t robot)> sent;
};

enum class Ids {
  kFixed,     // index + 1
  kDistinct,  // drawn, at first all different; a node may change its own
  kRandom,    // drawn
};

template <class P>
class CoreRobot {
 public:
  using W = Wire<P>;
  struct Settings {
    uint8_t ttl = 3;
    uint8_t channels = 1;  // a robot's messages take turns on them
    Ids ids = Ids::kFixed;
  };

  CoreRobot(const Settings& settings, const RobotHooks& hooks, uint32_t index,
            const RobotClock& clock, uint64_t seed)
      : settings_(settings), hooks_(hooks), index_(index), clock_(clock), random_(seed) {
    restart();
  }

  /// A fresh node in place of the old one; a fixed id stays. The random numbers go on.
  void restart() {
    node_ = std::make_unique<Swarmtalk<P>>(Port{&read_clock, &draw, this});
    if (settings_.ids == Ids::kFixed)
      node_->set_node_id(static_cast<typename W::NodeId>(index_ + 1));
    if (P::kEpochBits != 0) node_->set_epoch(static_cast<uint16_t>(random_()));
    for (uint8_t i = 0; i < settings_.channels; ++i) {
      Channel<P>* channel = node_->new_channel(i, settings_.ttl, false);
      publishers_[i] = channel->new_publisher(&CoreRobot::on_sent, this);
      channel->new_subscriber(32000, &CoreRobot::on_message, this);
    }
  }

  bool send(const uint8_t* bytes, uint16_t size) {
    if (publishers_[turn_]->send(bytes, size) != Error::kOk) return false;
    if (++turn_ == settings_.channels) turn_ = 0;
    return true;
  }
  uint16_t pull(uint8_t* out) { return node_->pull_packet(out); }
  void receive(const uint8_t* packet, uint16_t size) {
    typename P::Sensing sensing{};
    set_distance(sensing);
    node_->on_packet(packet, size, sensing);
  }
  /// The id drawn, or fixed.
  uint32_t id() const { return node_->node_id(); }
  uint64_t id_collisions() const { return node_->counters().id_collisions; }
  uint64_t id_changes() const { return node_->counters().id_changes; }
  Swarmtalk<P>& node() { return *node_; }

 private:
  static constexpr uint8_t kMaxChannels = P::kChannels < 4 ? P::kChannels : 4;

  static void set_distance(PoseSensing& sensing) { sensing.distance_m = 0.1f; }
  template <class Sensing>
  static void set_distance(Sensing& sensing) {
    sensing.distance = 100;
  }
  static uint32_t read_clock(void* self) { return static_cast<CoreRobot*>(self)->clock_.ticks(); }
  static uint32_t draw(void* self) {
    return static_cast<uint32_t>(static_cast<CoreRobot*>(self)->random_());
  }
  static void on_sent(void* self) {
    const auto& robot = *static_cast<CoreRobot*>(self);
    robot.hooks_.sent(robot.index_);
  }
  static void on_message(void* self, const uint8_t* bytes, uint16_t size, const Reception<P>&) {
    const auto& robot = *static_cast<CoreRobot*>(self);
    robot.hooks_.message(robot.index_, bytes, size);
  }

  Settings settings_;
  const RobotHooks& hooks_;
  uint32_t index_;
  const RobotClock& clock_;
  std::mt19937 random_;
  std::unique_ptr<Swarmtalk<P>> node_;
  Publisher<P>* publishers_[kMaxChannels] = {};
  uint8_t turn_ = 0;
};

}  // namespace swarmtalk::core::testing
