#include "view/playback.hpp"

#include <algorithm>
#include <utility>

#include "text/counted.hpp"

namespace swarmtalk::view {
namespace {

using recording::Record;
using std::chrono::duration_cast;
using std::chrono::nanoseconds;

constexpr auto kPlaybackTurn = std::chrono::milliseconds(50);
constexpr nanoseconds kMostPass = std::chrono::seconds(1);  // of real time, as after a suspension
constexpr std::uint64_t kMemoryNs = nanoseconds(Swarm::kForgetAfter).count();
constexpr std::uint64_t kTrailNs = nanoseconds(Playback::kTrail).count();
constexpr std::uint64_t kTrailStepNs = nanoseconds(Playback::kTrailStep).count();

Time time_of(std::uint64_t ns) {
  return Time(nanoseconds(static_cast<std::int64_t>(ns)));
}

std::uint64_t ns_of(Playback::Milliseconds ms) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(nanoseconds(ms).count(), 0));
}

Pose pose_of(const recording::Position& position) {
  return {position.x_m(), position.y_m(), position.theta_rad(),
          std::chrono::milliseconds(position.age_ms())};
}

Loss loss_of(const recording::Lost& lost) {
  return {lost.air(), lost.kernel(), lost.daemon(), lost.client(), lost.late()};
}

Message message_of(const recording::HeardMessage& heard) {
  Message message;
  message.payload = heard.payload();
  message.channel = static_cast<std::uint16_t>(heard.channel_number());
  message.sender = heard.sender();
  message.epoch = heard.epoch();
  message.message_number = heard.message_number();
  if (heard.has_distance_m()) message.distance_m = heard.distance_m();
  if (heard.has_bearing_rad()) message.bearing_rad = heard.bearing_rad();
  if (heard.has_sender_pose()) message.sender_pose = pose_of(heard.sender_pose());
  message.hops = heard.has_hops() ? heard.hops() : Message::kHopsUnknown;
  message.ttl = heard.ttl();
  message.local = heard.local();
  if (heard.has_lost_before()) message.lost_before = loss_of(heard.lost_before());
  if (heard.has_origin()) message.origin.emplace();
  return message;
}

}  // namespace

std::string Playback::open(const std::string& path) {
  if (std::string problem = reader_.open(path); !problem.empty()) return problem;
  file_ = path.substr(path.find_last_of('/') + 1);
  index_.scan(reader_);
  if (index_.records() == 0) {
    const std::string why = reader_.problem();
    return path + ": it holds no records of swarmtalk-cli record" + (why.empty() ? "" : "; " + why);
  }
  problem_ = reader_.problem();
  if (index_.bad_times() > 0) {
    problem_ += (problem_.empty() ? "" : "; ") + text::counted(index_.bad_times(),
                                                               "record has an impossible time",
                                                               "records have impossible times");
  }
  if (const std::string text = index_.misplaced().text("record"); !text.empty()) {
    problem_ += (problem_.empty() ? "" : "; ") + text;
  }
  jump_to(index_.first_ns());
  return {};
}

/// The next record that can be shown.
bool Playback::next(Record& record) {
  while (reader_.next(record)) {
    if (RecordingIndex::is_shown(record)) return true;
  }
  return false;
}

Playback::Milliseconds Playback::length() const {
  return duration_cast<Milliseconds>(time_of(index_.last_ns()) - time_of(index_.first_ns()));
}

Playback::Milliseconds Playback::at() const {
  return duration_cast<Milliseconds>(time_of(at_ns_) - time_of(index_.first_ns()));
}

Playback::Milliseconds Playback::known_since() const {
  const std::uint64_t first_ns = index_.first_ns();
  return duration_cast<Milliseconds>(time_of(std::max(known_since_ns_, first_ns)) -
                                     time_of(first_ns));
}

Time Playback::now() const {
  return time_of(at_ns_);
}

void Playback::play() {
  if (!jump_ns_ && at_ns_ >= index_.last_ns()) jump_ns_ = index_.first_ns();
  is_playing_ = true;
}

void Playback::seek(Milliseconds at) {
  jump_ns_ = at < length() ? index_.first_ns() + ns_of(at)
                           : index_.last_ns();  // its end is no whole millisecond
}

void Playback::set_speed(double speed) {
  speed_ = std::clamp(speed, kLeastSpeed, kMostSpeed);
}

void Playback::set_watched(bool is_watched) {
  is_watched_ = is_watched;
  if (!is_watched_ || is_waiting_) return;
  turned_at_ = Clock::now();
  wait_turn();
}

void Playback::wait_turn() {
  is_waiting_ = is_watched_;
  if (!is_waiting_) return;
  timer_.expires_after(kPlaybackTurn);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (error) return;
    const Time real_now = Clock::now();
    pass(real_now - std::exchange(turned_at_, real_now));
    wait_turn();
  });
}

void Playback::pass(nanoseconds real_time) {
  if (jump_ns_) {
    jump_to(*std::exchange(jump_ns_, std::nullopt));
    return on_jump();
  }
  if (!is_playing_) return;
  const nanoseconds passed = std::clamp(real_time, nanoseconds(0), kMostPass);
  const auto step = static_cast<std::uint64_t>(static_cast<double>(passed.count()) * speed_);
  run_to(std::min(at_ns_ + step, index_.last_ns()));
  if (at_ns_ >= index_.last_ns()) is_playing_ = false;
}

void Playback::jump_to(std::uint64_t time_ns) {
  const auto tell_message = std::exchange(on_message, [](const HeardMessage&) {});
  const auto tell_line = std::exchange(on_line, [](const LogLine&) {});
  swarm_ = Swarm();
  traffic_ = Traffic();
  recent_.clear();
  held_.reset();
  trail_.clear();
  const RecordingIndex::Start start = index_.start_before(time_ns, kMemoryNs, kMostRecordsOfAJump);
  known_since_ns_ = start.known_since_ns;
  reader_.go_to(start.place);
  for (std::uint64_t back_ns = kTrailNs; back_ns > 0; back_ns -= kTrailStepNs) {
    if (time_ns < index_.first_ns() + back_ns) continue;
    run_to(time_ns - back_ns);
    add_step();
  }
  run_to(time_ns);
  on_message = tell_message;
  on_line = tell_line;
}

void Playback::add_step() {
  Step& step = trail_.emplace_back();
  step.at = at();
  for (const auto& [id, robot] : swarm_.robots()) {
    if (!robot.place || step.spots.size() == kMostSpots) continue;
    step.spots.push_back({id, robot.place->x_m, robot.place->y_m});
  }
}

void Playback::run_to(std::uint64_t time_ns) {
  for (;;) {
    if (!held_) {
      held_.emplace();
      if (!next(*held_)) {
        held_.reset();
        break;
      }
    }
    if (held_->time_ns > time_ns) break;
    take(*held_);
    held_.reset();
  }
  at_ns_ = time_ns;
  swarm_.forget_old(time_of(time_ns));
}

void Playback::take(const Record& record) {
  const Time at = time_of(record.time_ns);
  switch (record.kind) {
    case Record::Kind::kHeard:
      return take_heard(record.heard, at);
    case Record::Kind::kLogLine:
      return take_line(record.log_line.robot(), record.log_line.text(), at);
    case Record::Kind::kPose:
      return take_pose(record.pose, at);
    case Record::Kind::kLosses:
      return take_losses(record.losses);
    case Record::Kind::kValue:
      return swarm_.note_value(record.value.robot(), record.value.key().substr(0, 64),
                               record.value.value().substr(0, 512));
    case Record::Kind::kReception:
      return take_reception(record.reception, at);
    case Record::Kind::kOther:
      return;
  }
}

// Lines of the channel "debug" come as log lines.
void Playback::take_heard(const recording::HeardMessage& heard, Time at) {
  if (heard.channel() == "debug") return;
  const Message message = message_of(heard);
  if (heard.channel() == "harvest") return take_harvest(message, at);
  ChannelTraffic* const known = traffic_.channel(message.channel);
  if (known != nullptr && !is_channel_number(heard.channel())) known->name = heard.channel();
  if (message.hops == 0 && !message.local && !message.origin) {
    swarm_.note_sign(message.sender, at);
  }
  take_message(message, at, heard.payload_bytes());
}

void Playback::take_pose(const recording::RobotPose& pose, Time at) {
  std::optional<Pose> known;
  if (pose.has_pose()) known = pose_of(pose.pose());
  if (pose.own()) return swarm_.note_own_pose(pose.robot(), known, at);
  Neighbour neighbour;
  neighbour.node_id = pose.robot();
  neighbour.link = pose.link();
  neighbour.age = std::chrono::milliseconds(pose.heard_age_ms());
  neighbour.pose = known;
  if (pose.has_distance_m()) neighbour.distance_m = pose.distance_m();
  if (pose.has_bearing_rad()) neighbour.bearing_rad = pose.bearing_rad();
  neighbour.loss = pose.loss();
  neighbour.frames = pose.frames();
  neighbour.frames_lost = pose.frames_lost();
  neighbour.out_of_range = pose.out_of_range();
  swarm_.note_neighbours({neighbour}, at);
}

void Playback::take_losses(const recording::ChannelLosses& losses) {
  if (losses.channel() == "debug") return;  // its messages are the log's lines
  ChannelTraffic* const known =
      traffic_.channel(static_cast<std::uint16_t>(losses.channel_number()));
  if (known == nullptr) return;
  if (!is_channel_number(losses.channel())) known->name = losses.channel();
  known->lost = loss_of(losses.lost());
}

void Playback::take_reception(const recording::Reception& reception, Time at) {
  SwarmRobot* const receiver = swarm_.robot(reception.receiver());
  if (receiver == nullptr || !reception.has_lost_before()) return;
  const auto found = receiver->hears.find(reception.sender());
  const float loss = found == receiver->hears.end() ? 0 : found->second.loss;
  swarm_.note_hearing(*receiver, reception.sender(), loss_after(loss, reception.lost_before()), at);
}

Status Playback::open_channel(const std::string& name) {
  if (number_of(name)) return Status();
  return Status(StatusCode::kBadChannel, "the recording has no messages of it");
}

std::optional<std::uint16_t> Playback::number_of(const std::string& name) const {
  for (const auto& [number, channel] : traffic_.channels()) {
    if (channel.name == name || std::to_string(number) == name) return number;
  }
  return index_.number_of(name);  // at other times
}

Status Playback::publish(const std::string&, const std::string&) {
  return Status(StatusCode::kLimit, "this is a recording: nothing can be sent into it");
}

}  // namespace swarmtalk::view
