// The swarm as messages of Foxglove's schemas and our own, encoded: what a 3D panel draws. Made
// once a turn for all viewers that want it. Reads no clock.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "view/scene/log_line.hpp"
#include "view/scene/swarm.hpp"

namespace swarmtalk::view {

/// What is advertised, by channel id less 1.
enum class Topic : std::size_t { kScene, kTransforms, kRobots, kLog };
inline constexpr std::size_t kTopics = 4;
inline constexpr std::size_t kStateTopics = 3;  // those of which only the newest counts

/// Encoded messages by topic; null: none.
using Pictures = std::array<std::shared_ptr<const std::string>, kTopics>;

/// @param wall_ns  wall clock at `now`, since 1970
Pictures draw(const Swarm& swarm, Time now, std::uint64_t wall_ns);

std::string encode_log(const LogLine& line, std::uint64_t wall_ns);

struct TopicDescription {
  const char* topic;       // "/swarm"
  const char* schema;      // "foxglove.SceneUpdate"
  std::string descriptor;  // FileDescriptorSet, in binary
};
const std::array<TopicDescription, kTopics>& topics();

}  // namespace swarmtalk::view
