#include "client_lib/handles.hpp"

#include <algorithm>

#include "client_lib/sender.hpp"

namespace swarmtalk::client {
namespace {

constexpr std::uint32_t kSentEveryMax = 64;

void fill(ipc::Channel& channel, const ChannelKey& key) {
  if (key.number) {
    channel.set_number(*key.number);
  } else {
    channel.set_name(key.name);
  }
}

template <typename List>
void erase_handle(List& list, const HandleState& handle) {
  std::erase_if(list, [&](const auto& entry) { return entry.get() == &handle; });
}

}  // namespace

void Handles::add(std::shared_ptr<PublisherState> publisher) {
  publishers_.push_back(std::move(publisher));
}

void Handles::add(std::shared_ptr<SubscriberState> subscriber) {
  subscribers_.push_back(std::move(subscriber));
}

void Handles::register_all() {
  is_registering_all_ = true;
  registrations_left_ = 1;  // ours, so that no answer ends it before all are asked
  for (const auto& subscriber : subscribers_) register_one(subscriber);
  for (const auto& publisher : publishers_) register_one(publisher);
  if (--registrations_left_ == 0) end_registering();
}

void Handles::end_registering() {
  is_registering_all_ = false;
  hooks_.on_all_registered();
}

void Handles::register_one(const std::shared_ptr<PublisherState>& publisher) {
  if (is_registering_all_) ++registrations_left_;
  publisher->is_answered = false;
  ipc::Advertise& body = *requests_.make().mutable_advertise();
  fill(*body.mutable_channel(), *publisher->key);
  const ChannelOptions& options = publisher->key->options;
  if (options.ttl) body.set_ttl(*options.ttl);
  if (options.timestamped) body.set_timestamped(*options.timestamped);
  const Sending& sending = publisher->sending;
  if (sending.queue > 0) body.set_queue(sending.queue);
  if (sending.drop_oldest) body.set_drop_oldest(true);
  if (!publisher->sent && !sending.drop_oldest) {
    // Nobody waits for each: a wake-up saved for most. Three quarters of the queue stay free.
    publisher->sent_every = std::clamp((sending.queue + 1) / 4, 1u, kSentEveryMax);
    if (publisher->sent_every > 1) body.set_sent_every(publisher->sent_every);
  }
  if (sending.copies != 1) body.set_copies(sending.copies);
  if (sending.copy_interval) {
    body.set_copy_interval_ms(static_cast<std::uint32_t>(
        std::clamp<std::int64_t>(sending.copy_interval->count(), 0, UINT32_MAX)));
  }
  if (sending.redundancy == Sending::kAutoRedundancy) {
    body.set_auto_redundancy(true);
  } else if (sending.redundancy != 0) {
    body.set_redundancy(sending.redundancy);
  }
  requests_.send([this, publisher](const ipc::Envelope* reply, const Status& status) {
    if (reply != nullptr) {
      const ipc::Advertised& advertised = reply->advertised();
      if (publisher->is_closed) {
        unregister_publisher(advertised.publisher_id());
      } else {
        const std::lock_guard lock(gate_);
        publisher->id = advertised.publisher_id();
        publisher->channel = static_cast<std::uint16_t>(advertised.channel());
        publisher->max_message_bytes = advertised.max_message_bytes();
        publisher->max_ttl = advertised.max_ttl();
        publisher->has_redundancy = advertised.has_redundancy();
        publisher->tells_time = !advertised.has_timestamped() || advertised.timestamped();
        publishers_by_id_[publisher->id] = publisher;
      }
    }
    finish_registration(*publisher, status);
  });
}

void Handles::register_one(const std::shared_ptr<SubscriberState>& subscriber) {
  if (is_registering_all_) ++registrations_left_;
  subscriber->is_answered = false;
  ipc::Subscribe& body = *requests_.make().mutable_subscribe();
  fill(*body.mutable_channel(), *subscriber->key);
  const Policy& policy = subscriber->policy;
  if (policy.keep_last) body.set_keep_last(*policy.keep_last);
  if (policy.max_distance_m) body.set_max_distance_m(*policy.max_distance_m);
  if (policy.drop_unknown_distance) body.set_drop_unknown_distance(true);
  if (policy.latest_of_each) body.set_latest_of_each(true);
  if (policy.looks_on) body.set_looks_on(true);
  if (policy.max_age) {
    body.set_max_age_ms(static_cast<std::uint32_t>(
        std::clamp<std::int64_t>(policy.max_age->count(), 0, UINT32_MAX)));
  }
  if (subscriber->key->options.timestamped) {
    body.set_timestamped(*subscriber->key->options.timestamped);
  }
  requests_.send([this, subscriber](const ipc::Envelope* reply, const Status& status) {
    if (reply != nullptr) {
      const ipc::Subscribed& subscribed = reply->subscribed();
      if (subscriber->is_closed) {
        unregister_subscriber(subscribed.subscription_id());
      } else {
        subscriber->id = subscribed.subscription_id();
        subscriber->channel = static_cast<std::uint16_t>(subscribed.channel());
        subscribers_by_id_[subscriber->id] = subscriber;
      }
    }
    finish_registration(*subscriber, status);
  });
}

void Handles::finish_registration(HandleState& handle, const Status& status) {
  {
    const std::lock_guard lock(gate_);
    handle.is_answered = true;
    handle.status = status;
    if (status && handle.id == 0 && !handle.is_closed) {
      handle.status = Status(StatusCode::kProtocol);
    }
  }
  if (status.code() == StatusCode::kDisconnected) return;
  if (!handle.status && !handle.is_closed) deliveries_.report(handle.status);
  if (is_registering_all_ && --registrations_left_ == 0) end_registering();
}

void Handles::remove(PublisherState& publisher) {
  report_refusals(publisher);
  std::uint32_t id = 0;
  {
    const std::lock_guard lock(gate_);
    publisher.is_closed = true;
    id = std::exchange(publisher.id, 0);
  }
  publishers_by_id_.erase(id);
  if (id != 0) unregister_publisher(id);
  erase_handle(publishers_, publisher);
}

void Handles::remove(SubscriberState& subscriber) {
  subscriber.is_closed = true;
  const auto id = std::exchange(subscriber.id, 0);
  subscribers_by_id_.erase(id);
  if (id != 0) unregister_subscriber(id);
  erase_handle(subscribers_, subscriber);
}

void Handles::unregister_publisher(std::uint32_t id) {
  requests_.make().mutable_unadvertise()->set_publisher_id(id);
  requests_.send_only();
  hooks_.on_unregistering();
}

void Handles::unregister_subscriber(std::uint32_t id) {
  requests_.make().mutable_unsubscribe()->set_subscription_id(id);
  requests_.send_only();
  hooks_.on_unregistering();
}

void Handles::forget(const Status& gone) {
  is_registering_all_ = false;
  for (auto& publisher : publishers_) {
    std::size_t unsent = 0;
    {
      const std::lock_guard lock(gate_);
      publisher->id = 0;
      publisher->status = gone;
      unsent = std::exchange(publisher->in_flight, {}).size();
    }
    for (; unsent > 0; --unsent) deliveries_.tell_sent(publisher, gone, false);
  }
  for (auto& subscriber : subscribers_) {
    subscriber->id = 0;
    subscriber->status = gone;
  }
  publishers_by_id_.clear();
  subscribers_by_id_.clear();
}

void Handles::close() {
  const auto forget = [](HandleState& handle) {
    handle.id = 0;
    handle.status = Status(StatusCode::kDisconnected, "the Client of this handle is gone");
  };
  for (auto& publisher : publishers_) forget(*publisher);
  for (auto& subscriber : subscribers_) forget(*subscriber);
  publishers_.clear();
  subscribers_.clear();
  publishers_by_id_.clear();
  subscribers_by_id_.clear();
}

void Handles::deliver(const ipc::DeliverFrame& frame, bool may_call) {
  const auto found = subscribers_by_id_.find(frame.subscription_id);
  if (found == subscribers_by_id_.end()) return;  // on its way when we unsubscribed
  const std::shared_ptr<SubscriberState> subscriber = found->second;  // the callback may remove it
  subscriber->has_heard = true;
  deliveries_.deliver(subscriber, frame, may_call);
}

void Handles::end_publication(std::uint32_t publisher_id, std::uint64_t number,
                              const Status& status, bool may_call) {
  const auto found = publishers_by_id_.find(publisher_id);
  if (found == publishers_by_id_.end()) {  // its handle is gone
    if (!status && status.code() != StatusCode::kDropped) {
      deliveries_.report_untold(Status(status.code(), kNotSent + std::string(status.text())));
    }
    return;
  }
  PublisherState& publisher = *found->second;
  {
    const std::lock_guard lock(gate_);
    auto& in_flight = publisher.in_flight;
    if (status && publisher.sent_every > 1) {
      while (!in_flight.empty() && in_flight.front() <= number) in_flight.pop_front();
      return;  // it has no callback
    }
    if (std::erase(in_flight, number) == 0) return;
  }
  const std::shared_ptr<PublisherState> keep_alive = found->second;
  deliveries_.tell_sent(keep_alive, status, may_call);
}

void Handles::report_refusals(PublisherState& publisher) {
  {
    const std::lock_guard lock(gate_);
    if (publisher.untold_refusals == 0 || publisher.id == 0) return;
    fill_refusals(publisher, *requests_.make().mutable_client_loss());
  }
  requests_.send_unnumbered();
}

void Handles::report_losses() {
  for (const auto& publisher : publishers_) report_refusals(*publisher);
  for (const auto& subscriber : subscribers_) {
    const std::uint32_t lost = std::exchange(subscriber->unreported_loss, 0);
    if (lost == 0 || subscriber->id == 0) continue;
    ipc::ClientLoss& loss = *requests_.make().mutable_client_loss();
    loss.set_subscription_id(subscriber->id);
    loss.set_messages(lost);
    requests_.send_unnumbered();
  }
}

}  // namespace swarmtalk::client
