#include "view/scene/swarm.hpp"

#include <algorithm>
#include <iterator>

namespace swarmtalk::view {
namespace {

Place place_of(const Pose& pose, Time now) {
  return {pose.x_m, pose.y_m, pose.theta_rad, now - pose.age};
}

}  // namespace

SwarmRobot* Swarm::robot(std::uint32_t id) {
  if (id == 0) return nullptr;
  const auto found = robots_.find(id);
  if (found != robots_.end()) return &found->second;
  if (robots_.size() >= kMostRobots) {
    ++left_out_;
    return nullptr;
  }
  SwarmRobot& made = robots_[id];
  made.id = id;
  return &made;
}

const SwarmRobot* Swarm::find(std::uint32_t id) const {
  const auto found = robots_.find(id);
  return found == robots_.end() ? nullptr : &found->second;
}

void Swarm::take_place(SwarmRobot& robot, const Place& place) {
  if (!robot.place || place.at >= robot.place->at) robot.place = place;
}

void Swarm::note_own_pose(std::uint32_t id, const std::optional<Pose>& pose, Time now) {
  if (id != self_) {
    robots_.erase(self_);
    self_ = id;
  }
  SwarmRobot* const self = robot(self_);
  if (self == nullptr) return;
  self->is_self = true;
  self->heard_at = now;
  self->place.reset();  // the daemon knows best, also that it does not know any more
  if (pose) self->place = place_of(*pose, now);
}

void Swarm::note_sign(std::uint32_t id, Time now) {
  SwarmRobot* const known = robot(id);
  if (known != nullptr && (!known->heard_at || *known->heard_at < now)) known->heard_at = now;
}

void Swarm::note_self(const DaemonStatus& status, Time now) {
  note_own_pose(status.node_id, status.pose, now);
  SwarmRobot* const self = robot(self_);
  if (self == nullptr) return;
  self->epoch = status.epoch;
  std::vector<std::string>& programs = self->programs.emplace();
  for (const ClientStatus& client : status.clients_served) programs.push_back(client.name);
  self->lost = Loss{};
  for (const ChannelStatus& channel : status.channels) *self->lost += channel.lost;
}

void Swarm::note_neighbours(const std::vector<Neighbour>& neighbours, Time now) {
  SwarmRobot* const self = robot(self_);
  for (const Neighbour& neighbour : neighbours) {
    if (neighbour.out_of_range) continue;  // its messages are dropped: it counts as not heard
    SwarmRobot* const heard = robot(neighbour.node_id);
    if (heard == nullptr || heard->is_self) continue;
    const Time heard_at = now - neighbour.age;
    // One robot may be heard on several links, and in an older run of its daemon: the freshest
    // tells.
    if (heard->heard_at && *heard->heard_at > heard_at) continue;
    heard->heard_at = heard_at;
    heard->epoch = neighbour.epoch;
    heard->link = neighbour.link;
    heard->address = neighbour.address;
    heard->distance_m = neighbour.distance_m;
    heard->bearing_rad = neighbour.bearing_rad;
    heard->frames = neighbour.frames;
    heard->frames_lost = neighbour.frames_lost;
    heard->has_namesake = neighbour.duplicate_id;
    heard->is_ghost = neighbour.is_ghost;
    if (neighbour.pose) take_place(*heard, place_of(*neighbour.pose, now));
    if (self != nullptr) note_hearing(*self, neighbour.node_id, neighbour.loss, heard_at);
  }
}

void Swarm::note_place(std::uint32_t id, const Pose& pose, Time now) {
  SwarmRobot* const known = robot(id);
  if (known != nullptr && !known->is_self) take_place(*known, place_of(pose, now));
}

void Swarm::note_report(std::uint32_t id, const report::Facts& facts, Time said_at) {
  SwarmRobot* const known = robot(id);
  if (known == nullptr) return;
  if (facts.name) known->name = *facts.name;
  for (const report::Value& each : facts.values) note_value(id, each.key, each.text);
  if (known->is_self) return;  // its daemon itself tells all the rest
  if (known->told_at && *known->told_at >= said_at) return;
  known->told_at = said_at;
  if (facts.place) {
    const float turn = static_cast<float>(facts.place->theta_turns16) / 65536.0f;
    const float theta = (turn > 0.5f ? turn - 1.0f : turn) * 6.2831853f;
    take_place(*known, {static_cast<float>(facts.place->x_mm) / 1000.0f,
                        static_cast<float>(facts.place->y_mm) / 1000.0f, theta,
                        said_at - std::chrono::milliseconds(facts.place->age_10ms * 10)});
  }
  for (const report::Hearing& each : facts.hears) {
    note_hearing(*known, each.node, static_cast<float>(each.loss_255) / 255.0f, said_at);
  }
  for (const report::ChannelUse& each : facts.channels) {
    if (known->channels.contains(each.number) || known->channels.size() < kMostValues) {
      known->channels[each.number] = each;
    }
  }
  if (facts.lost) {
    known->lost =
        Loss{facts.lost->air, facts.lost->kernel, facts.lost->daemon, 0, facts.lost->late};
  }
  if (facts.programs) known->programs = facts.programs;
}

void Swarm::note_value(std::uint32_t id, const std::string& key, const std::string& value) {
  SwarmRobot* const known = robot(id);
  if (known == nullptr) return;
  if (!known->values.contains(key) && known->values.size() >= kMostValues) return;
  known->values[key] = value;
}

void Swarm::note_hearing(SwarmRobot& who, std::uint32_t heard, float loss, Time at) {
  const auto found = who.hears.find(heard);
  if (found == who.hears.end() && who.hears.size() >= kMostHeard) {
    const auto oldest = std::min_element(
        who.hears.begin(), who.hears.end(),
        [](const auto& one, const auto& other) { return one.second.at < other.second.at; });
    if (oldest->second.at >= at) return;
    who.hears.erase(oldest);
  }
  Hearing& hearing = who.hears[heard];
  if (at >= hearing.at) hearing = {std::clamp(loss, 0.0f, 1.0f), at};
}

void Swarm::forget_old(Time now) {
  for (auto each = robots_.begin(); each != robots_.end();) {
    SwarmRobot& robot = each->second;
    std::erase_if(robot.hears,
                  [&](const auto& entry) { return now - entry.second.at > kHearingKeptFor; });
    const std::optional<Time> sign = last_sign(robot);
    const bool is_old = !robot.is_self && (!sign || now - *sign > kForgetAfter);
    each = is_old ? robots_.erase(each) : std::next(each);
  }
}

float loss_after(float loss, std::uint32_t lost_before) {
  constexpr float kMessages = 32;
  const auto lost = std::min<std::uint32_t>(lost_before, 1000);
  for (std::uint32_t i = 0; i < lost; ++i) loss += (1 - loss) / kMessages;
  return loss - loss / kMessages;
}

std::optional<Time> last_sign(const SwarmRobot& robot) {
  std::optional<Time> last = robot.heard_at;
  if (robot.told_at && (!last || *robot.told_at > *last)) last = robot.told_at;
  if (!last && robot.place) last = robot.place->at;
  return last;
}

}  // namespace swarmtalk::view
