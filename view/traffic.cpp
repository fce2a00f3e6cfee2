#include "view/traffic.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::view {
namespace {

std::int64_t whole_seconds(Time time) {
  return std::chrono::duration_cast<std::chrono::seconds>(time.time_since_epoch()).count();
}

}  // namespace

void Rate::count(Time now) {
  const std::int64_t second = whole_seconds(now);
  const auto slots = static_cast<std::int64_t>(in_.size());
  if (second - second_ >= slots) in_.fill(0);
  for (std::int64_t each = std::max(second_ + 1, second - slots + 1); each <= second; ++each) {
    in_[static_cast<std::size_t>(each % slots)] = 0;
  }
  second_ = std::max(second, second_);
  if (!first_) first_ = second;
  ++in_[static_cast<std::size_t>(second % slots)];
}

double Rate::per_second(Time now) const {
  const std::int64_t second = whole_seconds(now);
  const auto slots = static_cast<std::int64_t>(in_.size());
  std::uint64_t sum = 0;
  const auto first = std::max<std::int64_t>(second - static_cast<std::int64_t>(kSeconds), 0);
  for (std::int64_t each = first; each < second; ++each) {
    const bool is_kept = each <= second_ && each > second_ - slots;
    if (is_kept) sum += in_[static_cast<std::size_t>(each % slots)];
  }
  const auto counted =
      std::clamp<std::int64_t>(second - first_.value_or(0), 1, static_cast<std::int64_t>(kSeconds));
  return static_cast<double>(sum) / static_cast<double>(counted);
}

ChannelTraffic* Traffic::channel(std::uint16_t number) {
  const auto found = channels_.find(number);
  if (found != channels_.end()) return &found->second;
  if (channels_.size() >= kMostChannels && !forget_one_unused()) return nullptr;
  ChannelTraffic& made = channels_[number];
  made.number = number;
  return &made;
}

// The one that has been silent for longest.
bool Traffic::forget_one_unused() {
  auto oldest = channels_.end();
  for (auto each = channels_.begin(); each != channels_.end(); ++each) {
    if (each->second.publishers + each->second.subscribers > 0) continue;
    if (oldest == channels_.end() || each->second.last < oldest->second.last) oldest = each;
  }
  if (oldest == channels_.end()) return false;
  channels_.erase(oldest);
  return true;
}

void Traffic::note_status(const DaemonStatus& status) {
  for (auto& [number, known] : channels_) known.publishers = known.subscribers = 0;
  for (const ChannelStatus& each : status.channels) {
    ChannelTraffic* const known = channel(each.number);
    if (known == nullptr) continue;
    if (!each.name.empty()) known->name = each.name;
    known->publishers = each.publishers;
    known->subscribers = each.subscribers;
    known->lost = each.lost;
  }
  // A window on it was open, and it was never heard.
  std::erase_if(channels_, [](const auto& each) {
    const ChannelTraffic& known = each.second;
    return known.publishers + known.subscribers == 0 && known.messages == 0 && !known.lost;
  });
}

std::uint64_t Traffic::note_message(const Message& message, Time now) {
  ++messages_;
  ChannelTraffic* const known = channel(message.channel);
  if (known == nullptr) return messages_;
  ++known->messages;
  known->bytes += message.payload.size();
  known->rate.count(now);
  known->last = now;
  if (known->senders.contains(message.sender) || known->senders.size() < kMostSenders) {
    known->senders[message.sender] = now;
  }
  return messages_;
}

const LogLine& Traffic::note_line(std::uint32_t robot, std::string text, Time now) {
  if (text.size() > kMostLineBytes) text.resize(kMostLineBytes);
  lines_.push_back({++line_count_, robot, std::move(text), now});
  if (lines_.size() > kMostLines) lines_.pop_front();
  return lines_.back();
}

}  // namespace swarmtalk::view
