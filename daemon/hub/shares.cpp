#include "daemon/hub/shares.hpp"

#include <unistd.h>

#include <algorithm>

#include "daemon/common/monotonic_ns.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr const char* kRemedy = "; publish more slowly";
constexpr std::size_t kMostUsers = 256;  // remembered; beyond, those without anything are forgotten

Refusal over(std::string text, std::uint64_t limit) {
  return {ipc::ERROR_LIMIT, std::move(text), limit};
}

Refusal too_fast(const std::string& who, std::uint32_t rate_hz, const char* what, const char* key) {
  return {ipc::ERROR_RATE,
          who + " asked for more than " + std::to_string(rate_hz) + " " + what + " per second, " +
              key + " under [limits]; ask less often",
          rate_hz};
}

std::string of_uid(const UserShare& user) {
  return "uid " + std::to_string(user.uid);
}

void hold_in(Share& share, Shares::End end, std::uint16_t channel) {
  ++(end == Shares::End::kPublisher ? share.publishers : share.subscriptions);
  ++share.channels[channel];
}

void release_in(Share& share, Shares::End end, std::uint16_t channel) {
  --(end == Shares::End::kPublisher ? share.publishers : share.subscriptions);
  const auto held = share.channels.find(channel);
  if (held != share.channels.end() && --held->second == 0) share.channels.erase(held);
}

}  // namespace

UserShare& Shares::user(std::uint32_t uid) {
  if (const auto found = users_.find(uid); found != users_.end()) return found->second;
  if (users_.size() >= kMostUsers) {
    std::erase_if(users_, [](const auto& entry) {
      return entry.second.clients == 0 && entry.second.waiting_messages == 0;
    });
  }
  UserShare& user = users_.emplace(uid, uid).first->second;
  user.is_operator = uid == 0 || uid == geteuid();
  user.requests = TokenBucket(limits_.requests_per_user_hz, limits_.requests_per_user_hz);
  user.changes = TokenBucket(limits_.changes_per_user_hz, limits_.changes_burst);
  return user;
}

// Of few places none is kept.
std::uint32_t Shares::places_for_others() const {
  return limits_.clients - std::min(limits_.operator_clients, limits_.clients / 4);
}

std::optional<Refusal> Shares::check_client(const UserShare& user, std::size_t clients) const {
  const std::uint32_t places = user.is_operator ? limits_.clients : places_for_others();
  if (clients >= places) {
    const std::string kept = user.is_operator || places == limits_.clients
                                 ? ""
                                 : " (" + std::to_string(limits_.clients - places) +
                                       " of them are kept for root, operator_clients)";
    return over("this daemon serves " + std::to_string(limits_.clients) + " clients at most" +
                    kept + most([](const UserShare& each) { return each.clients; }) +
                    "; end one, or raise clients under [limits]",
                limits_.clients);
  }
  if (user.is_operator || user.clients < limits_.clients_per_user) return std::nullopt;
  return over(of_uid(user) + " has " + std::to_string(user.clients) +
                  " clients already, clients_per_user under [limits]; end one, or raise that",
              limits_.clients_per_user);
}

void Shares::enter(UserShare& user, ClientShare& client) {
  ++user.clients;
  client.user = &user;
  client.requests = TokenBucket(limits_.requests_per_client_hz, limits_.requests_per_client_hz);
}

void Shares::leave(ClientShare& client) {
  if (client.user != nullptr) --client.user->clients;
  client.user = nullptr;
}

std::optional<Refusal> Shares::check_end(const ClientShare& client, End end,
                                         std::uint16_t channel) const {
  const UserShare* const user = client.user;
  if (user == nullptr) return std::nullopt;
  if (!client.channels.contains(channel) && client.channels.size() >= limits_.channels_per_client) {
    return over("this client uses " + std::to_string(client.channels.size()) +
                    " channels already, channels_per_client under [limits]; give one up, or raise "
                    "that",
                limits_.channels_per_client);
  }
  if (user->is_operator) return std::nullopt;
  if (!user->channels.contains(channel) && user->channels.size() >= limits_.channels_per_user) {
    return over("programs of " + of_uid(*user) + " use " + std::to_string(user->channels.size()) +
                    " channels already, channels_per_user under [limits]; end one, or raise that",
                limits_.channels_per_user);
  }
  const bool is_publisher = end == End::kPublisher;
  const std::uint32_t held = is_publisher ? user->publishers : user->subscriptions;
  const std::uint32_t most =
      is_publisher ? limits_.publishers_per_user : limits_.subscriptions_per_user;
  if (held < most) return std::nullopt;
  const std::string what = is_publisher ? "publishers" : "subscriptions";
  return over("programs of " + of_uid(*user) + " have " + std::to_string(held) + " " + what +
                  " already, " + what + "_per_user under [limits]; end one, or raise that",
              most);
}

void Shares::hold(ClientShare& client, End end, std::uint16_t channel) {
  hold_in(client, end, channel);
  if (client.user != nullptr) hold_in(*client.user, end, channel);
}

void Shares::release(ClientShare& client, End end, std::uint16_t channel) {
  release_in(client, end, channel);
  if (client.user != nullptr) release_in(*client.user, end, channel);
}

std::optional<Refusal> Shares::check_message(const ClientShare& client, std::size_t size_bytes,
                                             const Waiting& waiting) const {
  const UserShare* const user = client.user;
  const auto why_not = [&]() __attribute__((noinline))->std::optional<Refusal> {
    if (client.waiting_messages >= limits_.waiting_messages_per_client) {
      return over(std::to_string(client.waiting_messages) +
                      " messages of this client wait for a link already, "
                      "waiting_messages_per_client under [limits]" +
                      kRemedy,
                  limits_.waiting_messages_per_client);
    }
    if (user != nullptr && user->waiting_messages >= limits_.waiting_messages_per_user) {
      return over(std::to_string(user->waiting_messages) + " messages of " + of_uid(*user) +
                      " wait for a link already, waiting_messages_per_user under [limits]" +
                      kRemedy,
                  limits_.waiting_messages_per_user);
    }
    if (user != nullptr && user->waiting_bytes + size_bytes > limits_.waiting_bytes / 2) {
      return over(std::to_string(user->waiting_bytes) + " bytes of " + of_uid(*user) +
                      " wait for a link already, and one user may have half of waiting_bytes under "
                      "[limits]" +
                      kRemedy,
                  limits_.waiting_bytes / 2);
    }
    if (waiting.messages >= limits_.waiting_messages) {
      return over(std::to_string(waiting.messages) +
                      " messages of all clients wait for a link already, waiting_messages under "
                      "[limits]" +
                      most([](const UserShare& each) { return each.waiting_messages; }) + kRemedy,
                  limits_.waiting_messages);
    }
    if (waiting.bytes + size_bytes > limits_.waiting_bytes) {
      return over(
          std::to_string(waiting.bytes) +
              " bytes of all clients wait for a link already, waiting_bytes under [limits]" +
              most([](const UserShare& each) { return each.waiting_bytes; }) + kRemedy,
          limits_.waiting_bytes);
    }
    return std::nullopt;
  };
  // Nearly always there is room.
  const bool has_users_room =
      user == nullptr || (user->waiting_messages < limits_.waiting_messages_per_user &&
                          user->waiting_bytes + size_bytes <= limits_.waiting_bytes / 2);
  if (has_users_room && client.waiting_messages < limits_.waiting_messages_per_client &&
      waiting.messages < limits_.waiting_messages &&
      waiting.bytes + size_bytes <= limits_.waiting_bytes) {
    return std::nullopt;
  }
  return why_not();
}

std::optional<Refusal> Shares::take_request(ClientShare& client, std::uint32_t cost) const {
  if (client.user == nullptr) return std::nullopt;
  const std::uint64_t now_ns = monotonic_ns();
  if (!client.requests.take(now_ns, cost)) {
    return too_fast("this client", limits_.requests_per_client_hz, "requests",
                    "requests_per_client_hz");
  }
  if (client.user->requests.take(now_ns, cost)) return std::nullopt;
  return too_fast("programs of " + of_uid(*client.user), limits_.requests_per_user_hz, "requests",
                  "requests_per_user_hz");
}

std::optional<Refusal> Shares::take_change(ClientShare& client) const {
  if (client.user == nullptr || client.user->changes.take(monotonic_ns())) return std::nullopt;
  return too_fast("programs of " + of_uid(*client.user), limits_.changes_per_user_hz,
                  "changes of the daemon", "changes_per_user_hz");
}

std::string Shares::users_of(std::uint16_t channel) const {
  std::string users;
  for (const auto& [uid, user] : users_) {
    if (user.channels.contains(channel)) users += (users.empty() ? "" : ", ") + of_uid(user);
  }
  return users;
}

template <class Count>
std::string Shares::most(Count count) const {
  const auto largest = std::max_element(
      users_.begin(), users_.end(),
      [&](const auto& a, const auto& b) { return count(a.second) < count(b.second); });
  if (largest == users_.end() || count(largest->second) == 0) return "";
  return ", most of it held by " + of_uid(largest->second) + " (" +
         std::to_string(count(largest->second)) + ")";
}

std::string Shares::most_channels() const {
  return most([](const UserShare& each) { return each.channels.size(); });
}

std::vector<ShareView> Shares::view(const UserShare& user) const {
  const bool is_free = user.is_operator;
  return {{"clients", user.clients, is_free ? limits_.clients : limits_.clients_per_user},
          {"channels", user.channels.size(), is_free ? 0 : limits_.channels_per_user},
          {"subscriptions", user.subscriptions, is_free ? 0 : limits_.subscriptions_per_user},
          {"publishers", user.publishers, is_free ? 0 : limits_.publishers_per_user},
          {"waiting_messages", user.waiting_messages, limits_.waiting_messages_per_user},
          {"waiting_bytes", user.waiting_bytes, limits_.waiting_bytes / 2}};
}

}  // namespace swarmtalk::daemon
