// What Engine remembers of the handles it gave out. A handle and the session share it; whichever
// goes first marks it.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include <swarmtalk/client/channel.hpp>

namespace swarmtalk::client {

struct ChannelKey {
  std::string name;
  std::optional<std::uint32_t> number;  // unset: by name
  Status problem;                       // what no daemon could take; else the daemon judges
  ChannelOptions options;
  std::string label;  // for people: "channel hello"
};

struct OwnPose {
  float x_m = 0;
  float y_m = 0;
  float theta_rad = 0;
  bool is_fixed = false;  // it does not age
};

struct HandleState {
  std::weak_ptr<Engine> session;
  std::shared_ptr<const ChannelKey> key;
  bool is_closed = false;    // its handle is gone: no more callbacks
  bool is_answered = false;  // the daemon has answered on this connection
  std::uint32_t id = 0;      // given by the daemon; 0: not registered
  std::optional<std::uint16_t> channel;
  Status status{StatusCode::kDisconnected};
};

/// What changes here after the handle is made changes under the session's gate: any thread sends.
struct PublisherState : HandleState {
  SentCallback sent;
  Sending sending;
  std::size_t max_message_bytes = 0;
  std::uint32_t max_ttl = 0;
  bool has_redundancy = false;          // the daemon sends repair packets, as asked
  bool tells_time = true;               // the daemon wants to know when each message was sent
  std::uint32_t sent_every = 1;         // the daemon tells of so many messages at once
  std::uint64_t publish_number = 0;     // of the last accepted message
  std::deque<std::uint64_t> in_flight;  // without an answer yet, oldest first
  std::uint32_t untold_refusals = 0;    // messages refused here that the daemon does not know of
  std::optional<std::chrono::steady_clock::time_point> refusals_told_at;  // by send() itself
};

struct SubscriberState : HandleState {
  /// Whether messages are read ahead, so that the policy holds for what has left the daemon, too.
  bool reads_ahead() const {
    return policy.keep_last || policy.latest_of_each || policy.max_age.has_value();
  }

  ReceiveCallback receive;
  bool has_heard = false;                        // any message
  std::deque<std::unique_ptr<Message>> waiting;  // as many as there are events of it
  Loss lost;                                     // before the next callback
  std::uint32_t unreported_loss = 0;  // in this program, that the daemon does not know of yet
  Policy policy;
};

}  // namespace swarmtalk::client
