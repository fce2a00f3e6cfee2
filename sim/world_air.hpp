// The radio of World: turns, carrier sense, collisions, losses. Part of world.hpp.
#pragma once

#include <algorithm>

#include "sim/world.hpp"

namespace swarmtalk::sim {

template <class P>
void World<P>::take_turn(uint32_t index) {
  Robot& robot = *robots_[index];
  robot.has_turn_waiting = robot.is_alive;
  if (!robot.is_alive) return;
  const RadioConfig& radio = config_.radio;
  if (robot.node->has_packet()) {
    if (robot.radio.is_taken(now_us_, radio.turnaround_us)) {
      ++air_.deferred;
      queue_.push(now_us_ + 1 + robot.random.below(radio.backoff_us), index << kKindBits | kTurn);
      return;
    }
    transmit(index, robot);
  }
  const double stretch = 1 + radio.period_jitter * robot.random.symmetric();
  const uint64_t pause_us = static_cast<uint64_t>(radio.period_us * stretch);
  const uint64_t least_us = std::max<uint64_t>(pause_us, radio.air_us + 1);
  queue_.push(now_us_ + robot.clock.true_us(least_us), index << kKindBits | kTurn);
}

template <class P>
void World<P>::transmit(uint32_t index, Robot& robot) {
  robot.packet_bytes = robot.node->pull_packet(robot.packet);
  if (robot.packet_bytes == 0) return;
  ++air_.sent;
  if (hooks_.sent != nullptr) hooks_.sent(hooks_.context, index, robot.packet, robot.packet_bytes);
  const uint64_t end_us = robot.radio.send(now_us_, config_.radio.air_us);
  for (const Link& link : links_of(index)) arrive(index, link);
  queue_.push(end_us, index << kKindBits | kEnd);
}

/// A packet begins at one receiver. What cannot be received any more is counted here, what may
/// still be in finish().
template <class P>
void World<P>::arrive(uint32_t from, const Link& link) {
  Robot& receiver = *robots_[link.to];
  if (!receiver.is_alive) return;
  if (interference_.parts(robots_[from]->body, receiver.body, now_us_)) {
    ++air_.expected;
    ++air_.lost_partition;
    return;
  }
  const Damage damage = receiver.radio.begin(from, now_us_, config_.radio.air_us);
  if (damage == Damage::kNone) return;
  ++air_.expected;
  ++(damage == Damage::kSending ? air_.lost_while_sending : air_.lost_collision);
}

template <class P>
void World<P>::end_transmission(uint32_t index) {
  for (const Link& link : robots_[index]->links) {
    if (robots_[link.to]->radio.is_receiving(index)) finish(index, link);
  }
}

template <class P>
void World<P>::finish(uint32_t from, const Link& link) {
  Robot& receiver = *robots_[link.to];
  const RadioConfig& radio = config_.radio;
  const Damage damage = receiver.radio.end();
  ++air_.expected;
  if (damage == Damage::kCollision) {
    ++air_.lost_collision;
  } else if (damage == Damage::kSending) {
    ++air_.lost_while_sending;
  } else if (interference_.jams(receiver.body, now_us_)) {
    ++air_.lost_jam;
  } else if (radio.loss > 0 && receiver.random.uniform() < radio.loss) {
    ++air_.lost_noise;
  } else {
    ++air_.received;
    double distance_mm = static_cast<double>(link.distance_mm);
    if (radio.distance_noise_mm > 0) {
      distance_mm += radio.distance_noise_mm * receiver.random.normal();
    }
    double bearing_rad = 0;
    if (kHasBearing<typename P::Sensing>) {
      const Body& a = receiver.body;
      const Body& b = robots_[from]->body;
      bearing_rad = wrap(angle_of(b.y_mm - a.y_mm, b.x_mm - a.x_mm) - a.theta_rad +
                         radio.bearing_noise_rad * receiver.random.normal());
    }
    typename P::Sensing sensing{};
    sense(sensing, distance_mm, bearing_rad);
    const Robot& sender = *robots_[from];
    receiver.node->on_packet(sender.packet, sender.packet_bytes, sensing);
  }
}

/// Gives up what is being received: the receiver has died.
template <class P>
void World<P>::interrupt_reception(Robot& robot) {
  if (robot.radio.is_receiving()) {
    ++air_.expected;
    ++air_.lost_death;
  }
  robot.radio.end();
}

template <class P>
double World<P>::reach_mm(uint32_t from, uint32_t to) const {
  const RadioConfig& radio = config_.radio;
  if (radio.asymmetry <= 0) return radio.range_mm;
  const uint64_t bits = mix(mix(seed_ + from) ^ (uint64_t{to} + 1) << 20);
  return radio.range_mm * (1 + radio.asymmetry * (2 * Random::unit(bits) - 1));
}

template <class P>
auto World<P>::links_of(uint32_t index) -> const std::vector<Link>& {
  Robot& robot = *robots_[index];
  if (robot.knows_links) return robot.links;
  robot.knows_links = true;
  find_links(index, robot.links);
  return robot.links;
}

template <class P>
void World<P>::find_links(uint32_t index, std::vector<Link>& out) const {
  const Body& body = robots_[index]->body;
  out.clear();
  grid_.for_near(body.x_mm, body.y_mm, [&](uint32_t other) {
    if (other == index) return;
    const double dx = robots_[other]->body.x_mm - body.x_mm;
    const double dy = robots_[other]->body.y_mm - body.y_mm;
    const double distance_mm = std::sqrt(dx * dx + dy * dy);
    if (distance_mm <= reach_mm(index, other)) {
      out.push_back({other, static_cast<float>(distance_mm)});
    }
  });
  // The order of the cells' contents depends on who moved when; the order of links must not.
  std::sort(out.begin(), out.end(), [](const Link& a, const Link& b) { return a.to < b.to; });
}

}  // namespace swarmtalk::sim
