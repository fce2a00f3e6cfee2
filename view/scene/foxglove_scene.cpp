#include "view/scene/foxglove_scene.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <set>

#include "view/scene/foxglove.pb.h"
#include "view/scene/robots.pb.h"

namespace swarmtalk::view {
namespace {

constexpr const char* kMap = "map";
constexpr auto kGoneAfter = std::chrono::milliseconds(2500);  // as on the page
constexpr int kLifetimeSeconds = 2;  // entities that are not sent again disappear
constexpr double kBodyM = 0.11;      // a Coachbot's diameter
constexpr double kNameM = 0.09;

/// A string of protobuf is UTF-8: what is beyond ASCII is shown as '?'.
std::string utf8_of(std::string text) {
  for (char& each : text) {
    if (static_cast<unsigned char>(each) >= 0x80) each = '?';
  }
  return text;
}

double seconds_between(Time then, Time now) {
  return std::chrono::duration<double>(now - then).count();
}

void set_time(google::protobuf::Timestamp& to, std::uint64_t wall_ns) {
  to.set_seconds(static_cast<std::int64_t>(wall_ns / 1'000'000'000));
  to.set_nanos(static_cast<std::int32_t>(wall_ns % 1'000'000'000));
}

void set_color(foxglove::Color& to, double r, double g, double b, double a) {
  to.set_r(r);
  to.set_g(g);
  to.set_b(b);
  to.set_a(a);
}

/// From blue over yellow to red at half of the frames.
void set_loss_color(foxglove::Color& to, double loss) {
  const double part = std::clamp(loss / 0.5, 0.0, 1.0);
  set_color(to, 0.2 + 0.6 * part, 0.45 + 0.2 * part - 0.45 * part * part, 0.75 * (1 - part), 0.5);
}

/// Its number, and what it is called.
std::string name_of(const SwarmRobot& robot) {
  std::string text = std::to_string(robot.id);
  if (!robot.name.empty()) text += " " + utf8_of(robot.name);
  return text;
}

void set_heading(foxglove::Quaternion& to, double theta_rad) {
  to.set_z(std::sin(theta_rad / 2));
  to.set_w(std::cos(theta_rad / 2));
}

bool is_gone(const SwarmRobot& robot, Time now) {
  const auto sign = last_sign(robot);
  return !sign || now - *sign > kGoneAfter;
}

void begin_entity(foxglove::SceneEntity& entity, const std::string& id, std::uint64_t wall_ns) {
  set_time(*entity.mutable_timestamp(), wall_ns);
  entity.set_frame_id(kMap);
  entity.set_id(id);
  entity.mutable_lifetime()->set_seconds(kLifetimeSeconds);
}

void add_fact(foxglove::SceneEntity& entity, const char* key, const std::string& value) {
  foxglove::KeyValuePair& pair = *entity.add_metadata();
  pair.set_key(key);
  pair.set_value(value);
}

void set_body_color(foxglove::Color& to, const SwarmRobot& robot, Time now) {
  if (is_gone(robot, now)) return set_color(to, 0.6, 0.65, 0.7, 0.8);
  if (const auto led = robot.values.find("led"); led != robot.values.end()) {
    unsigned red = 0, green = 0, blue = 0;
    if (std::sscanf(led->second.c_str(), "#%2x%2x%2x", &red, &green, &blue) == 3) {
      return set_color(to, red / 255.0, green / 255.0, blue / 255.0, 1);
    }
  }
  if (robot.is_self) return set_color(to, 0.85, 0.45, 0.1, 1);
  set_color(to, 0.2, 0.5, 0.8, 1);
}

void add_robot(foxglove::SceneUpdate& update, const SwarmRobot& robot, Time now,
               std::uint64_t wall_ns) {
  foxglove::SceneEntity& entity = *update.add_entities();
  begin_entity(entity, "robot/" + std::to_string(robot.id), wall_ns);
  foxglove::ArrowPrimitive& arrow = *entity.add_arrows();
  arrow.mutable_pose()->mutable_position()->set_x(static_cast<double>(robot.place->x_m));
  arrow.mutable_pose()->mutable_position()->set_y(static_cast<double>(robot.place->y_m));
  set_heading(*arrow.mutable_pose()->mutable_orientation(),
              static_cast<double>(robot.place->theta_rad));
  arrow.set_shaft_length(kBodyM * 0.6);
  arrow.set_shaft_diameter(kBodyM * 0.4);
  arrow.set_head_length(kBodyM * 0.6);
  arrow.set_head_diameter(kBodyM * 0.8);
  set_body_color(*arrow.mutable_color(), robot, now);
  foxglove::TextPrimitive& name = *entity.add_texts();
  foxglove::Vector3& above = *name.mutable_pose()->mutable_position();
  above = arrow.pose().position();
  above.set_y(above.y() + kBodyM);  // seen from above the arrow stays free
  above.set_z(kBodyM * 1.5);
  name.mutable_pose()->mutable_orientation()->set_w(1);
  name.set_billboard(true);
  name.set_font_size(kNameM);
  set_color(*name.mutable_color(), 0.1, 0.15, 0.2, 1);
  name.set_text(name_of(robot));
  add_fact(entity, "pose age", std::to_string(seconds_between(robot.place->at, now)) + " s");
}

void add_point(foxglove::LinePrimitive& lines, const Place& place, double loss) {
  foxglove::Point3& point = *lines.add_points();
  point.set_x(static_cast<double>(place.x_m));
  point.set_y(static_cast<double>(place.y_m));
  set_loss_color(*lines.add_colors(), loss);
}

/// The half at who hears: a link may lose more one way than the other.
void add_links(foxglove::SceneUpdate& update, const Swarm& swarm, Time now, std::uint64_t wall_ns) {
  foxglove::SceneEntity& entity = *update.add_entities();
  begin_entity(entity, "links", wall_ns);
  foxglove::LinePrimitive& lines = *entity.add_lines();
  lines.set_type(foxglove::LinePrimitive::LINE_LIST);
  lines.mutable_pose()->mutable_orientation()->set_w(1);
  lines.set_thickness(2);
  lines.set_scale_invariant(true);
  for (const auto& [id, robot] : swarm.robots()) {
    if (!robot.place || is_gone(robot, now)) continue;
    for (const auto& [heard, hearing] : robot.hears) {
      const SwarmRobot* const sender = swarm.find(heard);
      if (sender == nullptr || !sender->place || is_gone(*sender, now)) continue;
      Place middle = *robot.place;
      middle.x_m = (middle.x_m + sender->place->x_m) / 2;
      middle.y_m = (middle.y_m + sender->place->y_m) / 2;
      add_point(lines, *robot.place, static_cast<double>(hearing.loss));
      add_point(lines, middle, static_cast<double>(hearing.loss));
    }
  }
  if (lines.points_size() == 0) entity.clear_lines();
}

void add_transform(foxglove::FrameTransforms& transforms, const SwarmRobot& robot,
                   std::uint64_t wall_ns) {
  foxglove::FrameTransform& transform = *transforms.add_transforms();
  set_time(*transform.mutable_timestamp(), wall_ns);
  transform.set_parent_frame_id(kMap);
  transform.set_child_frame_id("robot/" + std::to_string(robot.id));
  transform.mutable_translation()->set_x(static_cast<double>(robot.place->x_m));
  transform.mutable_translation()->set_y(static_cast<double>(robot.place->y_m));
  set_heading(*transform.mutable_rotation(), static_cast<double>(robot.place->theta_rad));
}

void add_facts(Robot& to, const SwarmRobot& robot, Time now) {
  const auto age_s = [&](Time at) { return static_cast<float>(seconds_between(at, now)); };
  to.set_id(robot.id);
  to.set_is_self(robot.is_self);
  if (robot.place) {
    to.set_x_m(robot.place->x_m);
    to.set_y_m(robot.place->y_m);
    to.set_theta_rad(robot.place->theta_rad);
    to.set_pose_age_s(age_s(robot.place->at));
  }
  if (robot.heard_at) to.set_heard_age_s(age_s(*robot.heard_at));
  if (robot.told_at) to.set_told_age_s(age_s(*robot.told_at));
  if (!std::isnan(robot.distance_m)) to.set_distance_m(robot.distance_m);
  if (!std::isnan(robot.bearing_rad)) to.set_bearing_rad(robot.bearing_rad);
  if (robot.frames != 0) {
    to.set_frames(robot.frames);
    to.set_frames_lost(robot.frames_lost);
  }
  if (robot.lost) {
    to.set_lost_air(robot.lost->air);
    to.set_lost_kernel(robot.lost->kernel);
    to.set_lost_daemon(robot.lost->daemon);
  }
  for (const auto& [heard, hearing] : robot.hears) {
    Hears& entry = *to.add_hears();
    entry.set_id(heard);
    entry.set_loss(hearing.loss);
    entry.set_age_s(age_s(hearing.at));
  }
}

template <typename Proto>
std::shared_ptr<const std::string> encoded(const Proto& message) {
  return std::make_shared<const std::string>(message.SerializeAsString());
}

void add_file(const google::protobuf::FileDescriptor& file, std::set<std::string>& added,
              google::protobuf::FileDescriptorSet& to) {
  if (!added.insert(std::string(file.name())).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_file(*file.dependency(i), added, to);
  file.CopyTo(to.add_file());
}

template <typename Proto>
TopicDescription describe(const char* topic, const char* schema) {
  google::protobuf::FileDescriptorSet set;
  std::set<std::string> added;
  add_file(*Proto::descriptor()->file(), added, set);
  return {topic, schema, set.SerializeAsString()};
}

}  // namespace

Pictures draw(const Swarm& swarm, Time now, std::uint64_t wall_ns) {
  foxglove::SceneUpdate update;
  foxglove::FrameTransforms transforms;
  Robots robots;
  set_time(*robots.mutable_timestamp(), wall_ns);
  for (const auto& [id, robot] : swarm.robots()) {
    add_facts(*robots.add_robots(), robot, now);
    if (!robot.place) continue;
    add_robot(update, robot, now, wall_ns);
    add_transform(transforms, robot, wall_ns);
  }
  add_links(update, swarm, now, wall_ns);
  return {encoded(update), encoded(transforms), encoded(robots), nullptr};
}

std::string encode_log(const LogLine& line, std::uint64_t wall_ns) {
  foxglove::Log log;
  set_time(*log.mutable_timestamp(), wall_ns);
  log.set_level(foxglove::Log::INFO);
  log.set_name("robot/" + std::to_string(line.robot));
  log.set_message(utf8_of(line.text));
  return log.SerializeAsString();
}

const std::array<TopicDescription, kTopics>& topics() {
  static const std::array<TopicDescription, kTopics> all{
      describe<foxglove::SceneUpdate>("/swarm", "foxglove.SceneUpdate"),
      describe<foxglove::FrameTransforms>("/tf", "foxglove.FrameTransforms"),
      describe<Robots>("/robots", "swarmtalk.Robots"),
      describe<foxglove::Log>("/log", "foxglove.Log")};
  return all;
}

}  // namespace swarmtalk::view
