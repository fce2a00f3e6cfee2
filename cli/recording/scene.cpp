#include "cli/recording/scene.hpp"

namespace swarmtalk::cli {

void Scene::note(const DaemonStatus& daemon, const std::vector<Neighbour>& neighbours, Time now) {
  swarm_.note_self(daemon, now);
  note(neighbours, now);
}

void Scene::note(const std::vector<Neighbour>& neighbours, Time now) {
  swarm_.note_neighbours(neighbours, now);
}

void Scene::note(const Message& message, Time at) {
  if (message.local || !message.sender_pose) return;
  swarm_.note_place(message.transmitter, *message.sender_pose, at);
}

bool Scene::write_log(recording::Recorder& to, const Message& message, Time at) {
  view::LogLine line;
  line.robot = message.sender;
  line.text = message.payload;
  const auto topic = static_cast<std::size_t>(view::Topic::kLog);
  return write(to, topic, view::encode_log(line, to.clock().ns(at)), at);
}

std::vector<Scene::Shown> Scene::places() const {
  std::vector<Shown> places;
  for (const auto& [id, robot] : swarm_.robots()) {
    if (robot.place) {
      places.push_back({id, robot.place->x_m, robot.place->y_m, robot.place->theta_rad});
    }
  }
  return places;
}

bool Scene::draw(recording::Recorder& to, Time now) {
  if (now - drawn_at_ < kPeriod) return true;
  std::vector<Shown> places = this->places();
  if (places == shown_ && now - drawn_at_ < kStillPeriod) return true;
  return write(to, now, std::move(places));
}

bool Scene::draw_last(recording::Recorder& to, Time now) {
  std::vector<Shown> places = this->places();
  return places == shown_ || write(to, now, std::move(places));
}

bool Scene::write(recording::Recorder& to, Time now, std::vector<Shown> places) {
  shown_ = std::move(places);
  drawn_at_ = now;
  swarm_.forget_old(now);
  const view::Pictures pictures = view::draw(swarm_, now, to.clock().ns(now));
  for (std::size_t i = 0; i < view::kStateTopics; ++i) {
    if (!write(to, i, *pictures[i], now)) return false;
  }
  return true;
}

bool Scene::write(recording::Recorder& to, std::size_t topic, std::string_view bytes, Time at) {
  const view::TopicDescription& of = view::topics()[topic];
  return to.encoded(of.topic, {of.schema, "protobuf", of.descriptor}, bytes, at);
}

}  // namespace swarmtalk::cli
