#include "view/listening.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "text/plain.hpp"

namespace swarmtalk::view {
namespace {

constexpr auto kRetryPeriod = std::chrono::seconds(5);
constexpr std::uint32_t kMessagesHeld = 256;  // of one channel, while we are busy

/// "7" for "007".
std::string plain(const std::string& name) {
  return is_channel_number(name) ? std::to_string(std::atoi(name.c_str())) : name;
}

}  // namespace

bool is_refused(const Status& status) {
  switch (status.code()) {
    case StatusCode::kOk:
    case StatusCode::kDisconnected:
    case StatusCode::kNoDaemon:
    case StatusCode::kDaemonDead:
    case StatusCode::kNoPermission:
    case StatusCode::kVersionMismatch:
    case StatusCode::kTimeout:
      return false;
    default:
      return true;
  }
}

Listening::Entry Listening::find(const std::string& name) {
  const auto alias = aliases_.find(name);
  if (const auto found = held_.find(alias == aliases_.end() ? name : alias->second);
      found != held_.end()) {
    return found;
  }
  return is_channel_number(name) ? find(static_cast<std::uint16_t>(std::atoi(name.c_str())))
                                 : held_.end();
}

Listening::Entry Listening::find(std::uint16_t number) {
  return std::find_if(held_.begin(), held_.end(), [number](const auto& each) {
    return each.second.subscriber.channel_number() == number ||
           each.first == std::to_string(number);
  });
}

std::optional<std::uint16_t> Listening::number_of(const std::string& asked) const {
  const std::string name = plain(asked);
  if (is_channel_number(name)) return static_cast<std::uint16_t>(std::atoi(name.c_str()));
  const auto alias = aliases_.find(name);
  const auto found = held_.find(alias == aliases_.end() ? name : alias->second);
  return found == held_.end() ? std::nullopt : found->second.subscriber.channel_number();
}

Subscriber Listening::subscriber_of(const std::string& name) {
  const Channel channel =
      is_channel_number(name) ? client_.channel(std::atoi(name.c_str())) : client_.channel(name);
  return channel.subscriber(receive_, Policy::last(kMessagesHeld).looking_on());
}

/// @param entry  of the channel, if it is not refused: perhaps that of another name of it
Status Listening::subscribe(const std::string& name, Entry& entry) {
  Subscriber subscriber = subscriber_of(name);
  if (const Status status = subscriber.status(); is_refused(status)) return status;
  const std::optional<std::uint16_t> number = subscriber.channel_number();
  entry = number ? find(*number) : held_.end();
  if (entry != held_.end()) {
    aliases_[name] = entry->first;
    return Status();
  }
  entry = held_.emplace(name, Held()).first;
  entry->second.subscriber = std::move(subscriber);
  left_out_.erase(name);
  if (number) left_out_.erase(name_of(*number));
  return Status();
}

void Listening::drop(Entry entry) {
  std::erase_if(aliases_, [&](const auto& each) { return each.second == entry->first; });
  held_.erase(entry);
}

bool Listening::drop_one_in_use() {
  const auto found = std::find_if(held_.begin(), held_.end(), [](const auto& each) {
    return each.second.viewers == 0 && !each.second.is_kept;
  });
  if (found == held_.end()) return false;
  const auto number = found->second.subscriber.channel_number();
  leave_out(number ? name_of(*number) : found->first,
            Status(StatusCode::kLimit,
                   "its place is taken by a channel that is open in a window; close one, or raise "
                   "channels_per_client under [limits]"));
  drop(found);
  return true;
}

Status Listening::open(const std::string& asked) {
  const std::string name = plain(asked);
  Entry entry = find(name);
  const bool is_looked_at = entry != held_.end() && entry->second.viewers > 0;
  const auto looked_at = std::count_if(held_.begin(), held_.end(),
                                       [](const auto& each) { return each.second.viewers > 0; });
  if (!is_looked_at && static_cast<std::size_t>(looked_at) >= kMostLookedAt) {
    return Status(StatusCode::kLimit, std::to_string(kMostLookedAt) +
                                          " channels are open in windows already, the most there "
                                          "may be; close one");
  }
  if (entry == held_.end()) {
    Status status = subscribe(name, entry);
    if (status.code() == StatusCode::kLimit && drop_one_in_use()) status = subscribe(name, entry);
    if (!status) {
      leave_out(name, status);
      return status;
    }
  }
  ++entry->second.viewers;
  return Status();
}

void Listening::close(const std::string& asked) {
  const std::string name = plain(asked);
  const Entry entry = find(name);
  if (entry == held_.end() || entry->second.viewers == 0) return;
  const Held& held = entry->second;
  if (--entry->second.viewers == 0 && !held.is_kept && !held.is_in_use) drop(entry);
}

Status Listening::keep(const std::string& asked) {
  const std::string name = plain(asked);
  Entry entry = find(name);
  if (entry == held_.end()) {
    if (const Status status = subscribe(name, entry); !status) return status;
  }
  entry->second.is_kept = true;
  return Status();
}

std::string Listening::name_of(std::uint16_t number) const {
  const auto found = names_.find(number);
  return found == names_.end() ? std::to_string(number) : found->second;
}

void Listening::leave_out(const std::string& name, const Status& why) {
  if (left_out_.size() >= kMostLeftOut && !left_out_.contains(name)) return;
  left_out_.insert_or_assign(name, std::string(why.text()));
  if (told_.size() >= kMostTold || !told_.insert(name).second) return;
  std::fprintf(stderr, "swarmtalk-view: channel %s is left out: %s\n",
               text::shown_name(name.substr(0, kMostShown)).c_str(),
               text::plain(left_out_[name]).c_str());
}

void Listening::note_status(const DaemonStatus& status,
                            const std::set<std::uint16_t>& own_publishers,
                            const std::set<std::uint16_t>& reserved, Clock::time_point now) {
  const bool is_retry = now >= retry_at_;
  if (is_retry) retry_at_ = now + kRetryPeriod;
  for (auto& [name, held] : held_) held.is_in_use = false;
  names_.clear();
  std::set<std::string> in_use;
  for (const ChannelStatus& each : status.channels) {
    if (!each.name.empty()) names_[each.number] = each.name;
    if (reserved.contains(each.number)) continue;
    const bool is_in_use = each.publishers > (own_publishers.contains(each.number) ? 1u : 0u) ||
                           each.subscribers > each.onlookers;
    if (!is_in_use) continue;
    Entry entry = find(each.number);
    const std::string name = name_of(each.number);
    in_use.insert(name);
    if (entry == held_.end()) {
      if (left_out_.contains(name) && !is_retry) continue;
      if (const Status refused = subscribe(std::to_string(each.number), entry); !refused) {
        leave_out(name, refused);
        continue;
      }
    }
    entry->second.is_in_use = true;
  }
  // Refused when the daemon came back; or nobody uses it any more.
  for (Entry entry = held_.begin(); entry != held_.end();) {
    const Entry each = entry++;
    Held& held = each->second;
    const bool is_wanted = held.viewers > 0 || held.is_kept;
    const Status state = held.subscriber.status();
    if (is_refused(state)) leave_out(each->first, state);
    if (!is_wanted && (!held.is_in_use || is_refused(state))) {
      drop(each);
    } else if (is_refused(state) && is_retry) {
      held.subscriber = subscriber_of(each->first);
      if (held.subscriber.status()) left_out_.erase(each->first);
    }
  }
  // Gone since: there is nothing to listen to.
  std::erase_if(left_out_, [&](const auto& each) {
    return !in_use.contains(each.first) && find(each.first) == held_.end();
  });
}

}  // namespace swarmtalk::view
