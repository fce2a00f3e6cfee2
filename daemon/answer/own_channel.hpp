// OwnChannel: a channel on which the daemon itself speaks and listens, as a client of the hub like
// any session. On the daemon's thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/hub/hub.hpp"

namespace swarmtalk::daemon {

class OwnChannel {
 public:
  /// @param hub must outlive it
  explicit OwnChannel(Hub& hub) : hub_(hub) {}
  ~OwnChannel() {
    if (!is_open_) return;
    hub_.unadvertise(publisher_);
    hub_.unsubscribe(subscription_);
  }
  OwnChannel(const OwnChannel&) = delete;
  OwnChannel& operator=(const OwnChannel&) = delete;

  /// Advertises and subscribes to `name` for `client`, which must outlive it.
  /// @return why it cannot; nothing is open then
  std::optional<Refusal> open(std::string name, HubClient& client) {
    subscription_.client = publisher_.client = &client;
    const ChannelRequest request{std::move(name), std::nullopt, std::nullopt, 0};
    if (auto refusal = hub_.advertise(request, publisher_)) return refusal;
    if (auto refusal = hub_.subscribe(request, subscription_)) {
      hub_.unadvertise(publisher_);
      return refusal;
    }
    is_open_ = true;
    return std::nullopt;
  }

  /// @param ttl none: the channel's own
  /// @return why it is not sent
  std::optional<Refusal> publish(std::string_view payload,
                                 std::optional<std::uint32_t> ttl = std::nullopt) {
    return hub_.publish(publisher_, ++sent_, payload, ttl);
  }

  /// To this robot's programs alone: nothing goes on the air.
  void tell_programs(std::string_view payload) { hub_.tell_programs(publisher_, payload); }

  /// Its limits may be set before open().
  Publisher& publisher() { return publisher_; }

  /// The largest message that its links take, in bytes.
  std::size_t message_bytes() const { return hub_.limits(publisher_.channel).message_bytes; }

 private:
  Hub& hub_;
  Subscription subscription_;
  Publisher publisher_;
  std::uint64_t sent_ = 0;
  bool is_open_ = false;
};

}  // namespace swarmtalk::daemon
