// A sender of the 2020 code among nodes of ours: it draws each message's number from all 16, so a
// number may come back at once. It floods messages of one packet; the receivers, which all hear
// each other and it, send them on.
#pragma once

#include <cstdint>

#include "tests/swarm/scene.hpp"

namespace swarmtalk::core::testing {

struct OldSenderConfig {
  uint32_t receivers = 1;
  double sender_ticks = 16;  // between two messages
  double relay_ticks = 16;
  uint8_t ttl = 3;
  uint32_t messages = 1000;
  double loss = 0;
  uint64_t seed = 1;
};

/// @tparam P  a profile with the header of 2020 and message numbers of 4 bits
template <class P>
Counts old_sender(const OldSenderConfig& config) {
  using W = Wire<P>;
  SceneConfig scene_config;
  scene_config.range = 1e9;
  scene_config.loss = config.loss;
  scene_config.jitter = 0.1;
  scene_config.seed = config.seed;
  typename CoreRobot<P>::Settings settings;
  settings.ttl = config.ttl;
  Scene<CoreRobot<P>> scene(scene_config, settings);
  for (uint32_t i = 0; i <= config.receivers; ++i) {
    scene.add(i, 0, i == 0 ? config.sender_ticks : config.relay_ticks);
  }
  scene.connect();
  std::mt19937 numbers(static_cast<uint32_t>(config.seed));
  scene.on_slot = [&](uint32_t robot) {
    if (robot != 0) return false;
    if (scene.ledger().published_by(0) == config.messages) return true;
    const Tag tag = scene.ledger().next(0, 1);
    scene.ledger().published(tag);
    typename W::Header header = {};
    header.node = 200;
    header.message = static_cast<typename W::MessageNumber>(numbers() & W::kMessageMask);
    header.end = true;
    header.ttl = config.ttl;
    uint8_t packet[W::kMtuBytes] = {};
    W::encode(header, packet);
    tag.write(packet + W::kHeaderBytes);
    scene.broadcast(0, packet, W::seal(packet, W::kHeaderBytes + W::kBodyBytes));
    return true;
  };
  scene.drain(1e9);
  return scene.counts();
}

}  // namespace swarmtalk::core::testing
