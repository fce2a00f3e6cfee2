#include "recording/recorder.hpp"

#include <cmath>

#include "text/utf8.hpp"

namespace swarmtalk::recording {
namespace {

void copy(const swarmtalk::Pose& pose, Position& out) {
  out.set_x_m(pose.x_m);
  out.set_y_m(pose.y_m);
  out.set_theta_rad(pose.theta_rad);
  out.set_age_ms(static_cast<std::uint32_t>(pose.age.count()));
}

void copy(const Loss& loss, Lost& out) {
  out.set_air(loss.air);
  out.set_kernel(loss.kernel);
  out.set_daemon(loss.daemon);
  out.set_client(loss.client);
  out.set_late(loss.late);
}

}  // namespace

HeardMessage to_record(const std::string& channel, const swarmtalk::Message& message) {
  HeardMessage record;
  record.set_channel(channel);
  record.set_channel_number(message.channel);
  record.set_sender(message.sender);
  record.set_epoch(message.epoch);
  record.set_message_number(message.message_number);
  record.set_payload(message.payload);
  if (text::is_utf8(message.payload)) record.set_text(message.payload);
  if (message.has_distance()) record.set_distance_m(message.distance_m);
  if (message.has_bearing()) record.set_bearing_rad(message.bearing_rad);
  if (message.sender_pose) copy(*message.sender_pose, *record.mutable_sender_pose());
  if (message.hops != swarmtalk::Message::kHopsUnknown) record.set_hops(message.hops);
  record.set_ttl(message.ttl);
  if (message.buffering_delay) {
    record.set_buffering_delay_us(static_cast<std::uint64_t>(message.buffering_delay->count()));
  }
  record.set_local(message.local);
  if (message.lost_before) copy(message.lost_before, *record.mutable_lost_before());
  if (message.origin) {
    Origin& origin = *record.mutable_origin();
    if (!message.origin->link.empty()) {
      origin.set_link(message.origin->link);
      origin.set_node(message.origin->node);
      origin.set_message_number(message.origin->message_number);
    }
  }
  return record;
}

std::int64_t RecordClock::system_offset_ns() {
  using std::chrono::duration_cast;
  using std::chrono::nanoseconds;
  constexpr auto kClose = std::chrono::milliseconds(1);
  for (int tries = 0;; ++tries) {
    const auto before = Steady::now();
    const auto wall = std::chrono::system_clock::now().time_since_epoch();
    const auto steady = Steady::now();
    if (steady - before > kClose && tries < 10) continue;  // others ran in between
    return duration_cast<nanoseconds>(wall - steady.time_since_epoch()).count();
  }
}

std::optional<std::chrono::nanoseconds> RecordClock::was_set(std::int64_t offset_ns) {
  const std::chrono::nanoseconds step(offset_ns - offset_now_ns_);
  if (step < kLeastStep && -step < kLeastStep) return std::nullopt;
  offset_now_ns_ = offset_ns;
  return step;
}

std::uint64_t RecordClock::ns(Steady::time_point time) const {
  const auto steady = std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch());
  return static_cast<std::uint64_t>(steady.count() + offset_ns_);
}

std::string Recorder::open(const std::string& path, const std::string& library, bool replaces) {
  next_close_ = Clock::now() + kChunkPeriod;
  return topics_.writer().open(path, library, replaces);
}

bool Recorder::heard(const std::string& channel, const swarmtalk::Message& message,
                     Clock::time_point at) {
  const std::string& topic =
      channel_topics_.try_emplace(message.channel, std::string(kChannelTopics) + channel)
          .first->second;
  return topics_.write(topic, to_record(channel, message), clock_.ns(at), message.message_number);
}

bool Recorder::log_line(const swarmtalk::Message& message, Clock::time_point at) {
  LogLine line;
  line.set_robot(message.sender);
  line.set_epoch(message.epoch);
  // A string of protobuf must be UTF-8; the bytes themselves are on the channel's own topic.
  line.set_text(text::is_utf8(message.payload) ? message.payload : "(not UTF-8)");
  line.set_local(message.local);
  return topics_.write(std::string(kLogTopic), line, clock_.ns(at));
}

bool Recorder::own_pose(std::uint32_t robot, const std::optional<swarmtalk::Pose>& pose,
                        Clock::time_point at) {
  RobotPose record;
  record.set_robot(robot);
  record.set_own(true);
  if (pose) copy(*pose, *record.mutable_pose());
  return topics_.write(std::string(kPoseTopic), record, clock_.ns(at));
}

bool Recorder::neighbour(const swarmtalk::Neighbour& neighbour, Clock::time_point at) {
  RobotPose record;
  record.set_robot(neighbour.node_id);
  if (neighbour.pose) copy(*neighbour.pose, *record.mutable_pose());
  record.set_link(neighbour.link);
  if (std::isfinite(neighbour.distance_m)) record.set_distance_m(neighbour.distance_m);
  if (std::isfinite(neighbour.bearing_rad)) record.set_bearing_rad(neighbour.bearing_rad);
  record.set_loss(neighbour.loss);
  record.set_heard_age_ms(static_cast<std::uint32_t>(neighbour.age.count()));
  record.set_frames(neighbour.frames);
  record.set_frames_lost(neighbour.frames_lost);
  record.set_out_of_range(neighbour.out_of_range);
  return topics_.write(std::string(kPoseTopic), record, clock_.ns(at));
}

bool Recorder::losses(const swarmtalk::ChannelStatus& channel, Clock::time_point at) {
  ChannelLosses record;
  record.set_channel(channel.name.empty() ? std::to_string(channel.number) : channel.name);
  record.set_channel_number(channel.number);
  record.set_received(channel.received);
  copy(channel.lost, *record.mutable_lost());
  return topics_.write(std::string(kLossesTopic), record, clock_.ns(at));
}

bool Recorder::encoded(const std::string& topic, const McapSchema& schema, std::string_view bytes,
                       Clock::time_point at) {
  return topics_.write_encoded(topic, schema, bytes, clock_.ns(at));
}

bool Recorder::clock_was_set(std::chrono::nanoseconds by, Clock::time_point at) {
  return topics_.writer().write_metadata(
      kClockSetMetadata,
      {{"set_by_ns", std::to_string(by.count())}, {"time_ns", std::to_string(clock_.ns(at))}});
}

bool Recorder::tick(Clock::time_point now) {
  if (now < next_close_) return problem().empty();
  next_close_ = now + kChunkPeriod;
  return topics_.writer().close_chunk();
}

}  // namespace swarmtalk::recording
