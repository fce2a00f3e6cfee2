// Handles: the publishers and subscribers that a program holds, and how they are registered with
// the daemon, on each new connection again. On the owner's thread; what of a publisher other
// threads read is changed under the gate.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client_lib/deliveries.hpp"
#include "client_lib/requests.hpp"
#include "client_lib/state.hpp"

namespace swarmtalk::client {

class Handles {
 public:
  struct Hooks {
    std::function<void()> on_all_registered;  // after register_all()
    std::function<void()> on_unregistering;   // a request waits to be written
  };

  /// All must outlive it.
  Handles(std::mutex& gate, Requests& requests, Deliveries& deliveries, Hooks hooks)
      : gate_(gate), requests_(requests), deliveries_(deliveries), hooks_(std::move(hooks)) {}

  /// Remembers it; register_one() or register_all() registers it.
  void add(std::shared_ptr<PublisherState> publisher);
  void add(std::shared_ptr<SubscriberState> subscriber);
  void remove(PublisherState& publisher);
  void remove(SubscriberState& subscriber);

  void register_one(const std::shared_ptr<PublisherState>& publisher);
  void register_one(const std::shared_ptr<SubscriberState>& subscriber);
  void register_all();
  bool has_subscribers() const { return !subscribers_.empty(); }

  /// The connection is lost: nothing is registered any more, and what was on its way is unsent.
  void forget(const Status& gone);
  /// The Client is gone; the handles may outlive it. @pre gate held
  void close();

  void deliver(const ipc::DeliverFrame& frame, bool may_call);
  void end_publication(std::uint32_t publisher_id, std::uint64_t number, const Status& status,
                       bool may_call);
  /// The daemon counts what programs lose.
  void report_losses();

 private:
  void end_registering();
  void finish_registration(HandleState& handle, const Status& status);
  void report_refusals(PublisherState& publisher);
  void unregister_publisher(std::uint32_t id);
  void unregister_subscriber(std::uint32_t id);

  std::mutex& gate_;
  Requests& requests_;
  Deliveries& deliveries_;
  Hooks hooks_;
  std::vector<std::shared_ptr<PublisherState>> publishers_;
  std::vector<std::shared_ptr<SubscriberState>> subscribers_;
  std::unordered_map<std::uint32_t, std::shared_ptr<PublisherState>> publishers_by_id_;
  std::unordered_map<std::uint32_t, std::shared_ptr<SubscriberState>> subscribers_by_id_;
  bool is_registering_all_ = false;
  int registrations_left_ = 0;
};

}  // namespace swarmtalk::client
