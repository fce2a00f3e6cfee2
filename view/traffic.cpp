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
  return static_cast<double>(sum) / static_cast<double>(kSeconds);
}

ChannelTraffic* Traffic::channel(std::uint16_t number) {
  const auto found = channels_.find(number);
  if (found != channels_.end()) return &found->second;
  if (channels_.size() >= kMostChannels) return nullptr;
  ChannelTraffic& made = channels_[number];
  made.number = number;
  return &made;
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
