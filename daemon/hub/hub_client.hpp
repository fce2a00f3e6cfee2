// What the hub knows of a session: where messages and answers go, its subscriptions and publishers.
// The session owns them; the hub keeps pointers between subscribe/advertise and their opposite.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "daemon/hub/shares.hpp"
#include "daemon/message/loss.hpp"
#include "daemon/message/message.hpp"
#include "daemon/message/refusal.hpp"

namespace swarmtalk::daemon {

struct Publication;
struct Publisher;
struct Subscription;

/// Called by the hub at any time; must not call back into the hub.
class HubClient {
 public:
  HubClient() = default;
  HubClient(const HubClient&) = delete;
  HubClient& operator=(const HubClient&) = delete;
  virtual ~HubClient() = default;

  /// Which client this is, also when it is gone and its memory is another's. Never 0.
  std::uint64_t serial() const { return serial_; }

  ClientShare share;  // what it holds

  virtual void on_message(Subscription& subscription, const MessageRef& message) = 0;
  virtual void on_sent(Publisher& publisher, std::uint64_t publish_number) = 0;
  /// A publication that had been accepted could not be sent after all.
  virtual void on_unsent(std::uint32_t publisher_id, std::uint64_t publish_number,
                         const Refusal& refusal) = 0;
  /// The last link that carries a channel of its subscriptions has gone down. Once for all of them.
  virtual void on_links_down(const Refusal& /*why*/) {}

 private:
  static inline std::uint64_t last_serial_ = 0;  // all on the daemon's thread

  std::uint64_t serial_ = ++last_serial_;
};

/// Which channel a client means. Name first; number when there is no name.
struct ChannelRequest {
  std::string name;
  std::optional<std::uint32_t> number;
  std::optional<bool> is_timestamped;  // none: as registered, else as its number says, else no
  std::uint32_t ttl = 0;               // that a publisher wants
};

struct Subscription {
  HubClient* client = nullptr;
  std::uint32_t id = 0;                 // the client's
  std::optional<float> max_distance_m;  // none: any distance
  bool drops_unknown_distance = false;
  bool looks_on = false;  // it makes no channel one in use
  // Set by the hub.
  std::uint16_t channel = 0;
  std::string held_name;
  Loss lost;                  // before the next on_message(), which takes it
  std::uint64_t missing = 0;  // told as lost to this one, and not late yet
};

struct Publisher {
  HubClient* client = nullptr;  // none: it has gone, and the queue still leaves
  std::uint32_t id = 0;         // the client's
  std::uint8_t ttl = 0;
  std::uint32_t queue_limit = 0;       // messages that wait behind the one in flight
  bool drops_oldest = false;           // when they do; else the new one is refused
  std::uint32_t copies = 1;            // of each message on the air
  std::uint32_t copy_interval_ms = 0;  // between them
  std::uint8_t redundancy = 0;         // repair packets of each message: Station::protect_next()
  std::uint32_t sent_every = 1;        // the client is told of so many at once
  bool is_daemons_own = false;         // [reserved] is for programs; it has a pace of its own
  std::uint32_t untold_sent = 0;
  // Set by the hub.
  std::uint16_t channel = 0;
  std::string held_name;
  Publication* in_flight = nullptr;
  std::deque<Publication*> queue;  // accepted, oldest first
  bool is_starting_next = false;
};

}  // namespace swarmtalk::daemon
