// Shares: what each user and each client holds of what all share (places, channels, messages that
// wait, requests a second), and whether it may have more. So one program, or all programs of one
// user, leave something to the others. Owned by Hub; on the daemon's thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/common/token_bucket.hpp"
#include "daemon/config/config.hpp"
#include "daemon/message/refusal.hpp"

namespace swarmtalk::daemon {

/// What one client, or all clients of one user, hold.
struct Share {
  std::uint32_t subscriptions = 0;
  std::uint32_t publishers = 0;
  std::uint32_t waiting_messages = 0;               // accepted, not sent; those between copies too
  std::uint64_t waiting_bytes = 0;                  // payload of them
  std::map<std::uint16_t, std::uint32_t> channels;  // in use; subscriptions and publishers on each
};

struct UserShare : Share {
  explicit UserShare(std::uint32_t uid_) : uid(uid_) {}
  std::uint32_t uid;
  bool is_operator = false;  // root, or the daemon's own user: places are kept for them
  std::uint32_t clients = 0;
  TokenBucket requests{0, 1};
  TokenBucket changes{0, 1};
};

struct ClientShare : Share {
  UserShare* user = nullptr;  // none: not counted (a test's client)
  TokenBucket requests{0, 1};
};

/// What has been accepted of all clients and not sent.
struct Waiting {
  std::uint32_t messages = 0;  // without those that wait for their next copy's time
  std::uint64_t bytes = 0;     // payload, of all
};

/// One limit, as the status shows it.
struct ShareView {
  const char* name;
  std::uint64_t used;
  std::uint64_t limit;
};

class Shares {
 public:
  enum class End { kSubscription, kPublisher };

  explicit Shares(const LimitsConfig& limits) : limits_(limits) {}
  Shares(const Shares&) = delete;
  Shares& operator=(const Shares&) = delete;

  /// Whoever it is; stays where it is as long as it has clients or messages that wait.
  UserShare& user(std::uint32_t uid);

  /// Whether one more client has a place. @param clients  served already
  std::optional<Refusal> check_client(const UserShare& user, std::size_t clients) const;
  /// Counted until leave(). Gives the client its rates.
  void enter(UserShare& user, ClientShare& client);
  static void leave(ClientShare& client);

  /// Whether one more subscription or publisher on a channel has room.
  std::optional<Refusal> check_end(const ClientShare& client, End end, std::uint16_t channel) const;
  static void hold(ClientShare& client, End end, std::uint16_t channel);
  static void release(ClientShare& client, End end, std::uint16_t channel);

  /// Whether one more message may wait.
  std::optional<Refusal> check_message(const ClientShare& client, std::size_t size_bytes,
                                       const Waiting& waiting) const;

  /// Takes turns of the rates. @param cost  in cheap requests
  std::optional<Refusal> take_request(ClientShare& client, std::uint32_t cost) const;
  std::optional<Refusal> take_change(ClientShare& client) const;

  /// Who uses a channel: "uid 1000", or several; empty: nobody.
  std::string users_of(std::uint16_t channel) const;
  /// Who has most: ", most of them of uid 1000 (12)"; empty: nobody has any.
  std::string most_channels() const;

  const std::map<std::uint32_t, UserShare>& users() const { return users_; }
  std::vector<ShareView> view(const UserShare& user) const;

 private:
  template <class Count>
  std::string most(Count count) const;
  std::uint32_t places_for_others() const;

  const LimitsConfig& limits_;
  std::map<std::uint32_t, UserShare> users_;
};

}  // namespace swarmtalk::daemon
