// RunRecording: a run's log as a recording, for swarmtalk-view, Foxglove and Lichtblick: where each
// robot is, its LED and values, which messages were sent and who received them, and the same as
// pictures of Foxglove's schemas. Robots count from 1 there, as in labs; times are those of the
// run, from 0. The same log gives the same bytes. Single-threaded.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "recording/recorded.pb.h"
#include "recording/topic_writer.hpp"
#include "view/scene/swarm.hpp"

namespace swarmtalk::suite {

class RunRecording {
 public:
  static constexpr std::uint64_t kPoseNs = 1'000'000'000;    // poses are told again
  static constexpr std::uint64_t kValueNs = 10'000'000'000;  // and values
  static constexpr std::uint64_t kPictureNs = 250'000'000;   // while something moves
  static constexpr std::size_t kMostMovingPictures = 200;    // robots; with more: once a second
  static constexpr std::uint32_t kMessageNumbers = 16;       // of the compared packets

  /// @param path  overwritten @throws std::runtime_error  it cannot be written
  explicit RunRecording(const std::string& path);

  /// @param scenario  the log's first line @throws std::exception  it is none
  void begin(const nlohmann::json& scenario);
  /// The log's next line. @throws std::exception  it is none
  void add(const nlohmann::json& event);
  /// @throws std::runtime_error  not all of it could be written
  void finish();

 private:
  struct Robot {
    float x_m = 0, y_m = 0, theta_rad = 0;
    std::uint32_t sent = 0;
    std::map<std::string, std::string> values;
    std::uint64_t dies_ns = UINT64_MAX;
    std::uint64_t told_ns = 0;
  };
  struct Link {
    std::uint32_t receiver, sender, channel;
    auto operator<=>(const Link&) const = default;
  };

  void pass(std::uint64_t time_ns);
  void tell_pose(std::uint32_t id, std::uint64_t time_ns);
  void tell_value(std::uint32_t id, const std::string& key, std::uint64_t time_ns);
  void set_value(std::uint32_t id, const std::string& key, std::string value,
                 std::uint64_t time_ns);
  void add_sent(std::uint32_t id, const nlohmann::json& event, std::uint64_t time_ns);
  void add_received(std::uint32_t id, const nlohmann::json& event, std::uint64_t time_ns);
  void draw(std::uint64_t time_ns);
  Robot& robot(std::uint32_t id) { return robots_.at(id - 1); }

  recording::TopicWriter topics_;
  std::vector<Robot> robots_;                             // by id less 1
  std::map<std::uint32_t, std::uint32_t> robot_of_node_;  // as they start
  std::map<Link, std::uint32_t> last_numbers_;            // received
  view::Swarm swarm_;                                     // for the pictures
  std::uint64_t poses_ns_ = 0, values_ns_ = 0, picture_ns_ = 0, chunk_ns_ = 0;
  bool has_moved_ = true;
  bool is_one_hop_ = true;  // whoever is received from is the sender
};

}  // namespace swarmtalk::suite
