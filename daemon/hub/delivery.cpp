#include "daemon/hub/delivery.hpp"

#include <algorithm>

namespace swarmtalk::daemon {

void Delivery::note_losses(Channel& channel, std::size_t station, const MessageHead& head) {
  note_drops(station, head.drops);
  add_loss(channel, losses_.note({head.channel, head.sender, head.epoch}, head.number, drops_,
                                 head.received_at_ns));
  counters_.numbers_not_believed = losses_.doubted();
}

void Delivery::note_last(Channel& channel, std::size_t station, const MessageHead& head) {
  note_drops(station, head.drops);
  add_loss(channel, losses_.note_last({head.channel, head.sender, head.epoch}, head.number, drops_,
                                      head.received_at_ns));
  counters_.beacons_not_believed = losses_.disbelieved();
}

// What the station has dropped since it was asked last joins the sums.
void Delivery::note_drops(std::size_t station, const DropTotals& drops) {
  if (station >= station_drops_.size()) station_drops_.resize(station + 1);
  DropTotals& known = station_drops_[station];
  drops_.kernel += drops.kernel - known.kernel;
  drops_.node += drops.node - known.node;
  known = drops;
}

void Delivery::add_loss(Channel& channel, const Loss& lost) {
  if (lost == Loss{}) return;
  channel.lost += lost;
  counters_.messages_lost_air += lost.air;
  counters_.messages_lost_kernel += lost.kernel;
  counters_.messages_lost_memory += lost.daemon;
  counters_.messages_late += lost.late;
  for (Subscription* subscription : channel.subscriptions) {
    Loss told = lost;
    told.late = std::min(lost.late, subscription->missing);  // else it was lost before it was there
    subscription->missing += told.air + told.kernel + told.daemon - told.late;
    subscription->lost += told;
  }
}

void Delivery::deliver(Channel& channel, const MessageHead& head,
                       std::span<const std::uint8_t> payload) {
  ++counters_.messages_received;
  ++channel.received;
  hand_out(channel, pool_.take(head, payload, false), 0);
}

void Delivery::deliver_own(Channel& channel, const MessageHead& head,
                           std::span<const std::uint8_t> payload, std::uint64_t publisher) {
  hand_out(channel, pool_.take(head, payload, true), publisher);
}

void Delivery::hand_out(Channel& channel, const MessageRef& message, std::uint64_t except) {
  for (Subscription* subscription : channel.subscriptions) {
    if (except != 0 && subscription->client->serial() == except) continue;
    const float distance_m = message->distance_m;
    if (subscription->max_distance_m && distance_m > *subscription->max_distance_m) {
      ++counters_.deliveries_too_far;
      continue;
    }
    if (subscription->drops_unknown_distance && distance_m != distance_m) {  // NaN
      ++counters_.deliveries_unknown_distance;
      continue;
    }
    ++counters_.deliveries_queued;
    subscription->client->on_message(*subscription, message);
  }
}

}  // namespace swarmtalk::daemon
