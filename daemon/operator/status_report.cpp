#include "daemon/operator/status_report.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/session/client_requests.hpp"
#include "loop/clock.hpp"
#include "text/plain.hpp"

namespace swarmtalk::daemon {
namespace {

template <typename Repeated>
void add_counters(const drivers::Counters& counters, Repeated& repeated) {
  for (const auto& [name, value] : counters) {
    ipc::Counter& counter = *repeated.Add();
    counter.set_name(std::string(name));
    counter.set_value(value);
  }
}

std::uint64_t whole_ms(std::chrono::steady_clock::duration duration) {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
  return static_cast<std::uint64_t>(std::max<std::int64_t>(ms, 0));
}

void fill_settings(const drivers::Link& link, ipc::LinkStatus& entry) {
  const drivers::LinkSettings settings = link.settings();
  entry.set_interface(text::plain(settings.interface));
  entry.set_ethertype(settings.ethertype);
  entry.set_sealed(settings.is_sealed);
  entry.set_air_rate_mbps(settings.air_rate_mbps);
  if (settings.asked_buffer_bytes) entry.set_asked_buffer_bytes(*settings.asked_buffer_bytes);
  entry.set_given_buffer_bytes(settings.given_buffer_bytes);
  entry.set_packet_limit_bytes(link.packet_limit_bytes());
  if (settings.forward_jitter) {
    entry.set_forward_jitter_us(static_cast<std::uint32_t>(settings.forward_jitter->count()));
  }
}

constexpr int kMostUsersTold = 32;  // in a status, so that it fits a frame

/// Whether it speaks under our id, and has not taken another one since. Ghosts share one address.
bool has_our_id(Station& station, const Neighbour& neighbour, const std::vector<Neighbour>& all) {
  if (neighbour.node != station.identity().id()) return false;
  return std::none_of(all.begin(), all.end(), [&](const Neighbour& other) {
    return !other.is_ghost && other.hardware != 0 && other.hardware == neighbour.hardware &&
           other.last_heard > neighbour.last_heard;
  });
}

void fill_neighbour(Station& station, const Neighbour& from, Neighbour::Time now,
                    const drivers::Signals& signals, ipc::Neighbour& to) {
  const std::uint64_t age_ms = whole_ms(now - from.last_heard);
  to.set_link(station.name());
  to.set_node_id(from.node);
  to.set_epoch(from.epoch);
  if (from.hardware != 0) to.set_address(station.link().hardware_text(from.hardware));
  to.set_age_ms(age_ms);
  const auto signal = std::find_if(signals.begin(), signals.end(),
                                   [&](const auto& each) { return each.first == from.hardware; });
  if (signal != signals.end()) to.set_signal_dbm(signal->second);
  if (!std::isnan(from.range.distance_m)) to.set_distance_m(from.range.distance_m);
  if (!std::isnan(from.range.bearing_rad)) to.set_bearing_rad(from.range.bearing_rad);
  if (from.pose && !from.pose->is_stale()) {
    ipc::Pose& pose = *to.mutable_pose();
    pose.set_x_m(static_cast<float>(from.pose->x_m()));
    pose.set_y_m(static_cast<float>(from.pose->y_m()));
    pose.set_theta_rad(static_cast<float>(from.pose->theta_rad()));
    pose.set_age_ms(static_cast<std::uint32_t>(from.pose->age_10ms * 10u + age_ms));
  }
  to.set_frames(from.frames);
  to.set_frames_lost(from.frames_lost);
  to.set_loss(static_cast<float>(from.loss()));
  to.set_loss_frames(from.loss_frames());
  to.set_duplicate_id(from.is_duplicate);
  to.set_out_of_range(from.is_out_of_range);
  to.set_ghost(from.is_ghost);
}

}  // namespace

StatusReport::StatusReport(const Hub& hub, const PoseKeeper& poses, const NodeIdentity& identity,
                           const DaemonCounters& counters, std::string config_file)
    : hub_(hub),
      poses_(poses),
      identity_(identity),
      counters_(counters),
      config_file_(text::plain(config_file)) {}

void StatusReport::fill_hello(ipc::Hello& hello) {
  hello.set_major(ipc::kProtocolMajor);
  hello.set_minor(ipc::kProtocolMinor);
  hello.set_name(std::string("swarmtalkd ") + SWARMTALK_VERSION);
  hello.set_node_id(identity_.id());
}

void StatusReport::fill_status(ipc::Status& status) {
  const auto uptime = loop::now() - started_at_;
  status.set_version(SWARMTALK_VERSION);
  status.set_node_id(identity_.id());
  status.set_node_id_fixed(identity_.is_fixed());
  status.set_node_id_source(node_id_source_);
  status.set_epoch(identity_.epoch());
  status.set_uptime_ms(static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(uptime).count()));
  status.set_clients(clients_ == nullptr ? 0 : static_cast<std::uint32_t>(clients_->size()));
  status.set_config_file(config_file_);
  if (poses_.age_ms(loop::now())) {
    fill_own_pose(poses_, *status.mutable_pose());
  }
  fill_links(status);
  for (const ChannelView& view : hub_.channels()) {
    ipc::ChannelStatus& channel = *status.add_channels();
    channel.set_number(view.number);
    channel.set_name(view.name);
    channel.set_publishers(view.publishers);
    channel.set_subscribers(view.subscribers);
    channel.set_onlookers(view.onlookers);
    channel.set_timestamped(view.is_timestamped);
    channel.set_received(view.received);
    channel.set_lost_air(view.lost.air);
    channel.set_lost_kernel(view.lost.kernel);
    channel.set_lost_daemon(view.lost.daemon);
    channel.set_late(view.lost.late);
    channel.set_refused(view.refused);
    for (const std::string& link : view.links) channel.add_links(link);
  }
  if (clients_ != nullptr) clients_->fill(*status.mutable_clients_served());
  fill_users(status);
  add_counters(counters_.list(), *status.mutable_counters());
}

void StatusReport::fill_users(ipc::Status& status) const {
  for (const auto& [uid, user] : hub_.shares().users()) {
    if (user.clients == 0 && user.waiting_messages == 0) continue;
    if (status.users_size() == kMostUsersTold) return;
    ipc::UserStatus& entry = *status.add_users();
    entry.set_uid(uid);
    entry.set_is_operator(user.is_operator);
    for (const ShareView& view : hub_.shares().view(user)) {
      ipc::ShareStatus& share = *entry.add_shares();
      share.set_name(view.name);
      share.set_used(view.used);
      share.set_limit(view.limit);
    }
  }
}

void StatusReport::fill_neighbours(ipc::Neighbours& reply) {
  const auto now = loop::now();
  std::uint32_t left_out = 0;
  for (Station* station : hub_.stations()) {
    const std::vector<Neighbour> heard = station->neighbours(now);
    drivers::Signals signals;
    if (!heard.empty()) signals = station->link().signals();
    for (const Neighbour& each : heard) {
      if (reply.neighbours_size() < kMostNeighbours) {
        ipc::Neighbour& entry = *reply.add_neighbours();
        fill_neighbour(*station, each, now, signals, entry);
        if (has_our_id(*station, each, heard)) entry.set_duplicate_id(true);
      } else {
        ++left_out;
      }
    }
  }
  reply.set_left_out(left_out);
}

void StatusReport::fill_links(ipc::Status& status) const {
  for (Station* station : hub_.stations()) {
    const drivers::Link& link = station->link();
    const StationLimits& limits = station->limits();
    ipc::LinkStatus& entry = *status.add_links();
    entry.set_name(station->name());
    entry.set_type(link.type());
    entry.set_device(text::plain(link.device()));
    entry.set_profile(station->profile());
    entry.set_up(station->is_up());
    entry.set_state(text::plain(link.state()));
    entry.set_mtu_bytes(limits.max_packet_bytes);
    entry.set_max_message_bytes(limits.max_message_bytes);
    entry.set_max_ttl(limits.max_ttl);
    entry.set_node_id(station->identity().id());
    entry.set_max_channel(limits.max_channel);
    fill_settings(link, entry);
    add_counters(link.counters(), *entry.mutable_counters());
    add_counters(station->counters(), *entry.mutable_counters());
  }
}

}  // namespace swarmtalk::daemon
