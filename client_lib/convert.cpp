#include "client_lib/convert.hpp"

namespace swarmtalk::client {
namespace {

StatusCode convert_code(ipc::ErrorCode code) {
  switch (code) {
    case ipc::ERROR_VERSION:
      return StatusCode::kVersionMismatch;
    case ipc::ERROR_MALFORMED:
      return StatusCode::kProtocol;
    case ipc::ERROR_TOO_LONG:
      return StatusCode::kTooLong;
    case ipc::ERROR_BUSY:
      return StatusCode::kBusy;
    case ipc::ERROR_BAD_CHANNEL:
      return StatusCode::kBadChannel;
    case ipc::ERROR_CHANNEL_CONFLICT:
      return StatusCode::kChannelConflict;
    case ipc::ERROR_LIMIT:
      return StatusCode::kLimit;
    case ipc::ERROR_UNKNOWN_ID:
      return StatusCode::kProtocol;
    case ipc::ERROR_BAD_TTL:
      return StatusCode::kBadTtl;
    case ipc::ERROR_BAD_POSE:
      return StatusCode::kBadPose;
    case ipc::ERROR_UNSUPPORTED:
      return StatusCode::kUnsupported;
    case ipc::ERROR_LINK_DOWN:
      return StatusCode::kLinkDown;
    case ipc::ERROR_BAD_DISTANCE:
      return StatusCode::kBadArgument;
    case ipc::ERROR_DROPPED:
      return StatusCode::kDropped;
    case ipc::ERROR_RATE:
      return StatusCode::kRate;
    default:
      return StatusCode::kProtocol;
  }
}

Counter convert_counter(const ipc::Counter& from) {
  return {from.name(), from.value()};
}

LinkStatus convert_link(const ipc::LinkStatus& from) {
  LinkStatus to;
  to.name = from.name();
  to.type = from.type();
  to.device = from.device();
  to.profile = from.profile();
  to.up = from.up();
  to.state = from.state();
  to.mtu_bytes = from.mtu_bytes();
  to.max_message_bytes = from.max_message_bytes();
  to.max_ttl = from.max_ttl();
  to.node_id = from.node_id();
  to.max_channel = from.max_channel();
  for (const auto& counter : from.counters()) to.counters.push_back(convert_counter(counter));
  return to;
}

ChannelStatus convert_channel(const ipc::ChannelStatus& from) {
  ChannelStatus to;
  to.number = static_cast<std::uint16_t>(from.number());
  to.name = from.name();
  to.publishers = from.publishers();
  to.subscribers = from.subscribers();
  to.onlookers = from.onlookers();
  to.timestamped = from.timestamped();
  to.received = from.received();
  to.links.assign(from.links().begin(), from.links().end());
  to.refused = from.refused();
  to.lost = {from.lost_air(), from.lost_kernel(), from.lost_daemon(), 0, from.late()};
  return to;
}

ClientStatus convert_client(const ipc::ClientStatus& from) {
  ClientStatus to;
  to.name = from.name();
  to.pid = from.pid();
  to.uid = from.uid();
  to.subscriptions = from.subscriptions();
  to.publishers = from.publishers();
  to.queued_messages = from.queued_messages();
  to.queued_bytes = from.queued_bytes();
  to.deliveries_sent = from.deliveries_sent();
  to.lost_daemon = from.lost_daemon();
  to.lost_client = from.lost_client();
  to.messages_published = from.messages_published();
  to.refused = from.refused();
  return to;
}

}  // namespace

void convert(const ipc::DeliverFrame& deliver, Message& message) {
  message.payload.assign(deliver.payload);
  message.channel = static_cast<std::uint16_t>(deliver.channel);
  message.sender = deliver.sender;
  message.epoch = deliver.epoch;
  message.message_number = deliver.message_number;
  message.distance_m = deliver.distance_m.value_or(Message::kUnknown);
  message.bearing_rad = deliver.bearing_rad.value_or(Message::kUnknown);
  message.sender_pose.reset();
  if (const auto& pose = deliver.sender_pose) {
    message.sender_pose =
        Pose{pose->x_m, pose->y_m, pose->theta_rad, std::chrono::milliseconds(pose->age_ms)};
  }
  message.transmitter = deliver.transmitter == 0 ? deliver.sender : deliver.transmitter;
  message.hops = deliver.hops;
  message.ttl = deliver.ttl;
  message.buffering_delay.reset();
  if (deliver.buffering_delay_us) {
    message.buffering_delay = std::chrono::microseconds(*deliver.buffering_delay_us);
  }
  message.received_at.reset();
  if (deliver.received_at_ns) {  // steady_clock is CLOCK_MONOTONIC on Linux
    message.received_at =
        std::chrono::steady_clock::time_point(std::chrono::nanoseconds(*deliver.received_at_ns));
  }
  message.local = deliver.local;
  message.origin.reset();
  if (const auto& origin = deliver.origin) {
    message.origin = GatewayOrigin{std::string(origin->link), origin->node, origin->message_number};
  }
  const ipc::DeliverLost& lost = deliver.lost_before;
  message.lost_before = {lost.air, lost.kernel, lost.daemon, 0, lost.late};
}

std::optional<Pose> convert(const ipc::Pose& pose) {
  if (!pose.has_x_m() || !pose.has_y_m() || !pose.has_theta_rad()) return std::nullopt;
  return Pose{pose.x_m(), pose.y_m(), pose.theta_rad(), std::chrono::milliseconds(pose.age_ms())};
}

void convert(const ipc::Neighbours& from, std::vector<Neighbour>& to) {
  to.clear();
  for (const ipc::Neighbour& each : from.neighbours()) {
    Neighbour& made = to.emplace_back();
    made.link = each.link();
    made.node_id = each.node_id();
    made.epoch = each.epoch();
    made.address = each.address();
    made.age = std::chrono::milliseconds(each.age_ms());
    if (each.has_distance_m()) made.distance_m = each.distance_m();
    if (each.has_bearing_rad()) made.bearing_rad = each.bearing_rad();
    if (each.has_pose()) made.pose = convert(each.pose());
    made.frames = each.frames();
    made.frames_lost = each.frames_lost();
    made.loss = each.loss();
    made.duplicate_id = each.duplicate_id();
    made.out_of_range = each.out_of_range();
    if (each.has_signal_dbm()) made.signal_dbm = each.signal_dbm();
    made.is_ghost = each.ghost();
  }
}

void convert(const ipc::Status& from, DaemonStatus& to) {
  to = DaemonStatus();
  to.version = from.version();
  to.node_id = from.node_id();
  to.node_id_fixed = from.node_id_fixed();
  to.node_id_source = from.node_id_source();
  to.epoch = from.epoch();
  to.uptime = std::chrono::milliseconds(from.uptime_ms());
  to.clients = from.clients();
  if (from.has_pose()) {
    to.pose = convert(from.pose());
    to.pose_age = std::chrono::milliseconds(from.pose().age_ms());
    to.pose_told_by = from.pose().told_by();
    to.pose_max_age = std::chrono::milliseconds(from.pose().max_age_ms());
  }
  for (const auto& link : from.links()) to.links.push_back(convert_link(link));
  for (const auto& channel : from.channels()) to.channels.push_back(convert_channel(channel));
  for (const auto& client : from.clients_served()) {
    to.clients_served.push_back(convert_client(client));
  }
  for (const auto& user : from.users()) {
    UserStatus& entry = to.users.emplace_back(UserStatus{user.uid(), user.is_operator(), {}});
    for (const auto& share : user.shares()) {
      entry.shares.push_back({share.name(), share.used(), share.limit()});
    }
  }
  for (const auto& counter : from.counters()) to.counters.push_back(convert_counter(counter));
  to.config_file = from.config_file();
}

Status convert(const ipc::Failure& failure) {
  return Status(convert_code(failure.code()), failure.text());
}

}  // namespace swarmtalk::client
