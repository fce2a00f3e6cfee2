#include "daemon/answer/own_record.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace swarmtalk::daemon {
namespace {

template <typename Unsigned>
Unsigned cut_to(std::uint64_t value) {
  return static_cast<Unsigned>(
      std::min<std::uint64_t>(value, std::numeric_limits<Unsigned>::max()));
}

/// Those whose turn it is: `most` from `first` on, around the end.
template <typename T>
std::vector<T> take_turns(const std::vector<T>& all, std::size_t most, std::size_t& first) {
  if (all.size() <= most) return all;
  std::vector<T> taken;
  for (std::size_t i = 0; i < most; ++i) taken.push_back(all[(first + i) % all.size()]);
  first = (first + most) % all.size();
  return taken;
}

}  // namespace

std::size_t OwnRecord::neighbours(Time now) const {
  std::size_t count = 0;
  for (Station* station : hub_.stations()) count += station->neighbours(now).size();
  return count;
}

std::string OwnRecord::body(bool with_details, Time now) {
  report::Facts facts;
  add_place(facts, now);
  add_hearings(facts, with_details ? kMostHearingsInDetail : kMostHearings, now);
  add_channels(facts, with_details ? kMostChannelsInDetail : kMostChannels, now);
  if (!name_.empty() && (records_++ % kNameEvery == 0 || with_details)) facts.name = name_;
  if (with_details) add_details(facts);
  return report::encode_body(facts);
}

void OwnRecord::add_details(report::Facts& facts) {
  std::vector<std::string>& programs = facts.programs.emplace();
  for (const std::string& name : programs_()) {
    if (programs.size() < kMostPrograms) programs.push_back(name.substr(0, kMostNameBytes));
  }
  std::vector<report::Value> values;
  for (const auto& [key, text] : values_) values.push_back({key, text});
  facts.values = take_turns(values, kMostValuesInDetail, first_value_);
}

void OwnRecord::begin_values() {
  values_ = std::exchange(told_again_, {});
}

void OwnRecord::forget_values() {
  values_.clear();
  told_again_.clear();
}

// A key that is too long is left out, since cut ones might be the same; a text that is cut ends so.
void OwnRecord::note_value(std::string_view key, std::string_view text) {
  constexpr std::string_view kCut = "...";
  if (key.empty() || key.size() > report::kMostKeyBytes) return;
  if (!told_again_.contains(std::string(key)) && told_again_.size() >= kMostValues) return;
  std::string told(text.substr(0, report::kMostValueBytes));
  if (text.size() > told.size()) told.replace(told.size() - kCut.size(), kCut.size(), kCut);
  values_.insert_or_assign(std::string(key), told);
  told_again_.insert_or_assign(std::string(key), std::move(told));
}

// As frames carry it: a stale one is left out, since it would say nothing.
void OwnRecord::add_place(report::Facts& facts, Time now) const {
  const auto pose = poses_.on_air(now);
  if (!pose || pose->is_stale()) return;
  facts.place = report::Place{pose->x_mm, pose->y_mm, pose->theta_turns16, pose->age_10ms};
}

void OwnRecord::add_hearings(report::Facts& facts, std::size_t most, Time now) {
  std::vector<report::Hearing> all;
  for (Station* station : hub_.stations()) {
    for (const Neighbour& each : station->neighbours(now)) {
      if (each.is_out_of_range) continue;
      const double loss = std::clamp(each.loss(), 0.0, 1.0);
      all.push_back({each.node, static_cast<std::uint8_t>(std::lround(loss * 255.0))});
    }
  }
  facts.hears = take_turns(all, most, first_hearing_);
}

void OwnRecord::add_channels(report::Facts& facts, std::size_t most, Time now) {
  const bool is_first = counted_at_ == Time{};
  const double seconds = std::chrono::duration<double>(now - counted_at_).count();
  std::vector<report::ChannelUse> all;
  std::map<std::uint16_t, std::uint64_t> received;
  Loss lost;
  for (const ChannelView& view : hub_.channels()) {
    lost += view.lost;
    received[view.number] = view.received;
    report::ChannelUse use;
    use.number = view.number;
    use.publishers = cut_to<std::uint8_t>(view.publishers);
    use.subscribers = cut_to<std::uint8_t>(view.subscribers);
    const auto before = received_before_.find(view.number);
    if (!is_first && before != received_before_.end() && seconds > 0) {
      const double rate = static_cast<double>(view.received - before->second) / seconds;
      use.received_per_10s = cut_to<std::uint16_t>(static_cast<std::uint64_t>(rate * 10.0 + 0.5));
    }
    all.push_back(use);
  }
  received_before_ = std::move(received);
  counted_at_ = now;
  facts.channels = take_turns(all, most, first_channel_);
  facts.lost = report::Losses{cut_to<std::uint32_t>(lost.air), cut_to<std::uint32_t>(lost.kernel),
                              cut_to<std::uint32_t>(lost.daemon), cut_to<std::uint32_t>(lost.late)};
}

}  // namespace swarmtalk::daemon
