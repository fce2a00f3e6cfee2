// Channel, Publisher and Subscriber: what a Client hands out. Channel is a value; the other two are
// movable handles that unregister when destroyed. All belong to the Client's thread, except what
// says "any thread". They may be kept after the Client is gone: they then answer kDisconnected.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <type_traits>

#include <swarmtalk/client/bytes.hpp>
#include <swarmtalk/client/message.hpp>
#include <swarmtalk/client/nodiscard.hpp>
#include <swarmtalk/client/policy.hpp>
#include <swarmtalk/client/sending.hpp>
#include <swarmtalk/client/status.hpp>

namespace swarmtalk {

namespace client {
class Engine;
struct PublisherState;
struct SubscriberState;
struct ChannelKey;
}  // namespace client

/// Called with each message, inside process() and run*().
using ReceiveCallback = std::function<void(const Message&)>;
/// Called once for each accepted send(): ok when its last packet has left, else why it never will.
using SentCallback = std::function<void(const Status&)>;

/// How a program uses a channel.
struct ChannelOptions {
  std::optional<std::uint32_t> ttl;  // hops after the first; unset: 0
  std::optional<bool> timestamped;   // carries the buffering delay; unset: as registered, else no
};

/// Sends on a channel. Unregisters itself when it is destroyed.
class SWARMTALK_NODISCARD("it is unregistered when it is destroyed: keep it") Publisher {
 public:
  Publisher() = default;
  Publisher(Publisher&&) noexcept = default;
  Publisher& operator=(Publisher&&) noexcept;
  ~Publisher();

  /// Hands one message to the daemon; copies it, never blocks. Any thread.
  /// @param ttl  hops after the first for this message; unset: the channel's
  /// @return kOk: it is on its way, `sent` will be called; kBusy: as many wait as may (see
  /// Sending);
  ///   kTooLong; kBadTtl; kDisconnected; or why the channel was refused. kTooLong and kBadTtl are
  ///   also reported to Client::on_error, and kBusy when nobody looks at the Status: on stderr, or
  ///   to a Client::on_error of the program's own. So they are never silent.
  SWARMTALK_NODISCARD("a message that could not be taken is lost: look at it")
  Status send(std::string_view text, std::optional<std::uint32_t> ttl = {});
  /// The same for a literal.
  [[nodiscard]] Status send(const char* text, std::optional<std::uint32_t> ttl = {}) {
    return send(std::string_view(text), ttl);
  }
  /// The same for bytes.
  [[nodiscard]] Status send(Bytes bytes, std::optional<std::uint32_t> ttl = {}) {
    return send(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()), ttl);
  }

  /// A struct of plain numbers, byte for byte as it lies in memory (its padding too).
  template <typename T, std::enable_if_t<std::is_trivially_copyable_v<T> && !std::is_pointer_v<T> &&
                                             !std::is_array_v<T> &&
                                             !std::is_convertible_v<const T&, std::string_view> &&
                                             !std::is_convertible_v<const T&, Bytes>,
                                         int> = 0>
  [[nodiscard]] Status send(const T& value, std::optional<std::uint32_t> ttl = {}) {
    return send(std::string_view(reinterpret_cast<const char*>(&value), sizeof(T)), ttl);
  }

  /// Whether send() would answer kBusy. Any thread, as the four below.
  bool busy() const;

  /// Longest message of this channel, 0 while not registered.
  std::size_t max_message_bytes() const;

  /// Whether messages get the repair packets that Sending asks for. If not, the daemon is an older
  /// one, or the channel's links have none (only the profile `wifi` does).
  bool has_redundancy() const;

  /// Number of the channel, once the daemon has told it.
  std::optional<std::uint16_t> channel_number() const;

  /// Ok while registered; else kDisconnected or why the daemon refused.
  Status status() const;

 private:
  friend class Channel;
  explicit Publisher(std::shared_ptr<client::PublisherState> state) : state_(std::move(state)) {}
  std::shared_ptr<client::PublisherState> state_;
};

/// Hears a channel. Unregisters itself when it is destroyed.
class SWARMTALK_NODISCARD("nothing is heard once it is destroyed: keep it") Subscriber {
 public:
  Subscriber() = default;
  Subscriber(Subscriber&&) noexcept = default;
  Subscriber& operator=(Subscriber&&) noexcept;
  ~Subscriber();

  /// Number of the channel, once the daemon has told it.
  std::optional<std::uint16_t> channel_number() const;

  /// Ok while registered; else kDisconnected or why the daemon refused.
  Status status() const;

 private:
  friend class Channel;
  explicit Subscriber(std::shared_ptr<client::SubscriberState> state) : state_(std::move(state)) {}
  std::shared_ptr<client::SubscriberState> state_;
};

/// A channel by name or number; makes publishers and subscribers.
class Channel {
 public:
  /// Registers a publisher; waits for the daemon's answer, at most ClientOptions::request_timeout.
  /// Without a daemon it is registered when the daemon comes. A refusal is in its status() and goes
  /// to Client::on_error.
  Publisher publisher(SentCallback sent = {}, Sending sending = {}) const;

  /// The same for a subscriber.
  /// @param receive  called from Client::process() and run*() only; an empty one is refused with
  ///   kBadArgument
  Subscriber subscriber(ReceiveCallback receive, Policy policy = {}) const;

 private:
  friend class Client;
  Channel(std::weak_ptr<client::Engine> session, std::shared_ptr<const client::ChannelKey> key)
      : session_(std::move(session)), key_(std::move(key)) {}
  std::weak_ptr<client::Engine> session_;
  std::shared_ptr<const client::ChannelKey> key_;
};

}  // namespace swarmtalk
