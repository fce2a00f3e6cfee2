#include "suite/recording/run_recording.hpp"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "recording/recorder.hpp"
#include "view/scene/foxglove_scene.hpp"

namespace swarmtalk::suite {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kChunkNs = 10'000'000'000;  // a jump reads from such a place on

view::Time time_of(std::uint64_t ns) {
  return view::Time(std::chrono::nanoseconds(static_cast<std::int64_t>(ns)));
}

std::string colour_of(const Json& rgb) {
  char text[8];
  const auto part = [&](std::size_t i) { return rgb.at(i).get<unsigned>() & 0xFFu; };
  std::snprintf(text, sizeof text, "#%02x%02x%02x", part(0), part(1), part(2));
  return std::string(text) == "#000000" ? "off" : text;
}

}  // namespace

RunRecording::RunRecording(const std::string& path) {
  const std::string problem = topics_.writer().open(path, "swarmtalk-suite", true);
  if (!problem.empty()) throw std::runtime_error(problem);
}

void RunRecording::begin(const Json& scenario) {
  for (const Json& place : scenario.at("robots")) {
    Robot& made = robots_.emplace_back();
    made.x_m = place.at("x_mm").get<float>() / 1000;
    made.y_m = place.at("y_mm").get<float>() / 1000;
    made.theta_rad = place.value("theta_rad", 0.0F);
  }
  for (const Json& fault : scenario.value("faults", Json::array())) {
    if (fault.at("kind") != "death") continue;
    const double at_s = fault.value("at_s", 0.0);
    robots_.at(fault.at("robot").get<std::size_t>()).dies_ns =
        static_cast<std::uint64_t>(at_s * 1e9);
  }
  is_one_hop_ = scenario.at("program") != "news";
  for (std::uint32_t id = 1; id <= robots_.size(); ++id) tell_pose(id, 0);
  draw(0);
}

/// What comes again and again, up to this time.
void RunRecording::pass(std::uint64_t time_ns) {
  const auto alive = [&](std::uint64_t at_ns, auto tell) {
    for (std::uint32_t id = 1; id <= robots_.size(); ++id) {
      if (at_ns < robot(id).dies_ns) tell(id);
    }
  };
  for (;;) {
    const std::uint64_t next_ns = std::min({poses_ns_ + kPoseNs, values_ns_ + kValueNs,
                                            picture_ns_ + kPictureNs, chunk_ns_ + kChunkNs});
    if (next_ns > time_ns) return;
    if (next_ns == poses_ns_ + kPoseNs) {
      poses_ns_ = next_ns;
      alive(next_ns, [&](std::uint32_t id) { tell_pose(id, next_ns); });
    }
    if (next_ns == values_ns_ + kValueNs) {
      values_ns_ = next_ns;
      alive(next_ns, [&](std::uint32_t id) {
        for (const auto& [key, value] : robot(id).values) tell_value(id, key, next_ns);
      });
    }
    if (next_ns == picture_ns_ + kPictureNs) {
      picture_ns_ = next_ns;
      const bool is_moving = has_moved_ && robots_.size() <= kMostMovingPictures;
      if (is_moving || next_ns % kPoseNs == 0) draw(next_ns);
    }
    if (next_ns == chunk_ns_ + kChunkNs) {
      chunk_ns_ = next_ns;
      topics_.writer().close_chunk();
    }
  }
}

void RunRecording::add(const Json& event) {
  const std::string kind = event.at("event").get<std::string>();
  if (kind == "air")
    return pass(static_cast<std::uint64_t>(event.at("seconds").get<double>() * 1e9));
  const std::uint64_t time_ns = event.at("t").get<std::uint64_t>() * 1000;
  const std::uint32_t id = event.at("robot").get<std::uint32_t>() + 1;
  pass(time_ns);
  Robot& it = robots_.at(id - 1);
  if (kind == "start") {
    robot_of_node_[event.at("node").get<std::uint32_t>()] = id;
    std::erase_if(last_numbers_, [&](const auto& entry) { return entry.first.sender == id; });
  } else if (kind == "pose") {
    it.x_m = event.at("x_mm").get<float>() / 1000;
    it.y_m = event.at("y_mm").get<float>() / 1000;
    it.theta_rad = event.at("theta").get<float>();
    has_moved_ = true;
    tell_pose(id, time_ns);
  } else if (kind == "led") {
    set_value(id, "led", colour_of(event.at("rgb")), time_ns);
  } else if (kind == "value") {
    set_value(id, event.at("name").get<std::string>(),
              std::to_string(event.at("value").get<std::int64_t>()), time_ns);
  } else if (kind == "sent") {
    add_sent(id, event, time_ns);
  } else if (kind == "received") {
    add_received(id, event, time_ns);
  }
}

void RunRecording::tell_pose(std::uint32_t id, std::uint64_t time_ns) {
  const Robot& it = robot(id);
  recording::RobotPose pose;
  pose.set_robot(id);
  pose.mutable_pose()->set_x_m(it.x_m);
  pose.mutable_pose()->set_y_m(it.y_m);
  pose.mutable_pose()->set_theta_rad(it.theta_rad);
  pose.mutable_pose()->set_age_ms(0);
  topics_.write(std::string(recording::kPoseTopic), pose, time_ns);
  swarm_.note_sign(id, time_of(time_ns));
  swarm_.note_place(id, {it.x_m, it.y_m, it.theta_rad, std::chrono::milliseconds(0)},
                    time_of(time_ns));
}

void RunRecording::set_value(std::uint32_t id, const std::string& key, std::string value,
                             std::uint64_t time_ns) {
  robot(id).values[key] = std::move(value);
  swarm_.note_value(id, key, robot(id).values[key]);
  has_moved_ = has_moved_ || key == "led";
  tell_value(id, key, time_ns);
}

void RunRecording::tell_value(std::uint32_t id, const std::string& key, std::uint64_t time_ns) {
  recording::RobotValue value;
  value.set_robot(id);
  value.set_key(key);
  value.set_value(robot(id).values[key]);
  topics_.write(std::string(recording::kValuesTopic), value, time_ns);
}

void RunRecording::add_sent(std::uint32_t id, const Json& event, std::uint64_t time_ns) {
  const auto channel = event.at("channel").get<std::uint32_t>();
  recording::HeardMessage sent;
  sent.set_channel(std::to_string(channel));
  sent.set_channel_number(channel);
  sent.set_sender(id);
  sent.set_message_number(++robot(id).sent);
  sent.set_payload_bytes(event.at("bytes").get<std::uint32_t>());
  topics_.write(std::string(recording::kChannelTopics) + sent.channel(), sent, time_ns,
                sent.message_number());
}

void RunRecording::add_received(std::uint32_t id, const Json& event, std::uint64_t time_ns) {
  const auto sender = robot_of_node_.find(event.at("node").get<std::uint32_t>());
  if (sender == robot_of_node_.end()) return;  // of an id that nobody has started with
  recording::Reception reception;
  reception.set_receiver(id);
  reception.set_sender(sender->second);
  reception.set_channel_number(event.at("channel").get<std::uint32_t>());
  reception.set_message_number(event.at("message").get<std::uint32_t>());
  if (event.at("mm").get<long>() >= 0) {
    reception.set_distance_m(event.at("mm").get<float>() / 1000);
  }
  if (is_one_hop_) {
    const Link link{id, sender->second, reception.channel_number()};
    const auto before = last_numbers_.find(link);
    std::uint32_t lost = 0;
    if (before != last_numbers_.end()) {
      lost = (reception.message_number() - before->second - 1) % kMessageNumbers;
      if (lost == kMessageNumbers - 1) lost = 0;  // the same again
    }
    last_numbers_[link] = reception.message_number();
    reception.set_lost_before(lost);
    const view::SwarmRobot* const known = swarm_.find(id);
    if (known != nullptr) {
      const auto found = known->hears.find(sender->second);
      const float loss = found == known->hears.end() ? 0 : found->second.loss;
      swarm_.note_hearing(*swarm_.robot(id), sender->second, view::loss_after(loss, lost),
                          time_of(time_ns));
    }
  }
  topics_.write(std::string(recording::kHeardTopic), reception, time_ns);
}

void RunRecording::draw(std::uint64_t time_ns) {
  has_moved_ = false;
  swarm_.forget_old(time_of(time_ns));
  const view::Pictures pictures = view::draw(swarm_, time_of(time_ns), time_ns);
  for (std::size_t i = 0; i < view::kStateTopics; ++i) {
    const view::TopicDescription& topic = view::topics()[i];
    topics_.write_encoded(topic.topic, {topic.schema, "protobuf", topic.descriptor}, *pictures[i],
                          time_ns);
  }
}

void RunRecording::finish() {
  if (!topics_.writer().finish()) throw std::runtime_error(topics_.writer().problem());
}

}  // namespace swarmtalk::suite
