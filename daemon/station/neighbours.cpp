#include "daemon/station/neighbours.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace swarmtalk::daemon {
namespace {

using namespace std::chrono_literals;

constexpr auto kWindow = 5s;  // loss is told of this one and the one before
// A larger jump of a count is not a loss but a robot that was not heard for long.
constexpr std::uint32_t kLongestGap = 10'000;
constexpr int kNodeShift = 32;

std::uint64_t key_of(std::uint16_t node, std::uint32_t epoch) {
  return std::uint64_t{node} << kNodeShift | epoch;
}

std::uint64_t to_ns(Neighbour::Time time) {
  return static_cast<std::uint64_t>(std::chrono::nanoseconds(time.time_since_epoch()).count());
}

}  // namespace

double Neighbour::loss() const {
  const double lost = window_lost_ + previous_lost_;
  return loss_frames() > 0 ? lost / loss_frames() : 0.0;
}

std::uint32_t Neighbour::loss_frames() const {
  return window_heard_ + previous_heard_ + window_lost_ + previous_lost_;
}

Neighbours::Duplicate Neighbours::heard(const drivers::FrameReception& frame, const Range& range,
                                        bool is_out_of_range) {
  Neighbour& neighbour = entry(frame);
  count(neighbour, frame.frame_counter, frame.received_at);
  neighbour.last_heard = std::max(neighbour.last_heard, frame.received_at);
  if (frame.hardware != 0) neighbour.hardware = frame.hardware;
  neighbour.range = range;
  neighbour.is_out_of_range = is_out_of_range;
  neighbour.pose = frame.pose;
  neighbour.is_ghost = frame.is_ghost;
  Duplicate found = find_duplicate(neighbour);
  const bool is_double = frame.has_our_hardware && !frame.is_ghost;
  if (is_double && !std::exchange(neighbour.has_our_hardware, true))
    found.double_of_us = &neighbour;
  return found;
}

// A restarted robot falls silent under its old epoch; only a second robot is heard again after the
// other began.
Neighbours::Duplicate Neighbours::find_duplicate(Neighbour& neighbour) {
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (keys_[i] >> kNodeShift != neighbour.node) continue;
    Neighbour& other = entries_[i];
    if (other.epoch == neighbour.epoch || other.first_heard <= neighbour.first_heard) continue;
    if (neighbour.last_heard - other.last_heard > kForgetAfter) continue;
    const bool is_late = neighbour.last_heard - other.first_heard <= kLongestHeld;
    if (is_late && other.hardware != 0 && other.hardware == neighbour.hardware) continue;
    const bool is_known = neighbour.is_duplicate && other.is_duplicate;
    neighbour.is_duplicate = other.is_duplicate = true;
    if (!is_known) return {&neighbour, &other};
  }
  return {};
}

Neighbour& Neighbours::entry(const drivers::FrameReception& frame) {
  const std::uint64_t key = key_of(frame.transmitter, frame.transmitter_epoch);
  const auto found = std::find(keys_.begin(), keys_.end(), key);
  if (found != keys_.end()) return entries_[static_cast<std::size_t>(found - keys_.begin())];
  Neighbour made;
  made.node = frame.transmitter;
  made.epoch = frame.transmitter_epoch;
  made.first_heard = made.last_heard = made.window_began_ = frame.received_at;
  made.count_ = FollowedCount(frame.frame_counter - 1, to_ns(frame.received_at), true);
  if (entries_.size() < kMost) {
    keys_.push_back(key);
    return entries_.emplace_back(made);
  }
  const auto oldest =
      std::min_element(entries_.begin(), entries_.end(),
                       [](const auto& a, const auto& b) { return a.last_heard < b.last_heard; });
  if (frame.received_at - oldest->last_heard <= kForgetAfter) ++evicted_;
  keys_[static_cast<std::size_t>(oldest - entries_.begin())] = key;
  return *oldest = made;
}

void Neighbours::count(Neighbour& neighbour, std::uint32_t counter, Time now) {
  if (now - neighbour.window_began_ >= kWindow) {
    const bool is_next = now - neighbour.window_began_ < 2 * kWindow;
    neighbour.previous_heard_ = is_next ? neighbour.window_heard_ : 0;
    neighbour.previous_lost_ = is_next ? neighbour.window_lost_ : 0;
    neighbour.window_heard_ = neighbour.window_lost_ = 0;
    neighbour.window_began_ = now;
  }
  const FollowedCount::Step step = neighbour.count_.heard(counter, 0, to_ns(now));
  ++neighbour.frames;
  ++neighbour.window_heard_;
  if (step.distance > kLongestGap) return;
  neighbour.frames_lost += step.believed;
  neighbour.window_lost_ += step.believed;
}

// A robot began under its id, and it has not been heard since. Where a second robot has the id, the
// address says which of them began.
bool Neighbours::has_restarted(const Neighbour& neighbour) const {
  const auto is_successor = [&](const Neighbour& other) {
    if (other.node != neighbour.node || other.first_heard <= neighbour.first_heard) return false;
    if (!neighbour.is_duplicate) return true;
    return neighbour.hardware != 0 && other.hardware == neighbour.hardware &&
           neighbour.last_heard - other.first_heard <= kLongestHeld;
  };
  return std::any_of(entries_.begin(), entries_.end(), is_successor);
}

std::vector<Neighbour> Neighbours::list(Time now) const {
  std::vector<Neighbour> heard;
  for (const Neighbour& each : entries_) {
    if (now - each.last_heard <= kForgetAfter && !has_restarted(each)) heard.push_back(each);
  }
  std::sort(heard.begin(), heard.end(), [](const auto& a, const auto& b) {
    return std::tie(a.node, a.epoch) < std::tie(b.node, b.epoch);
  });
  for (std::size_t i = 0; i < heard.size(); ++i) {  // the other may be gone
    const bool is_first = i == 0 || heard[i - 1].node != heard[i].node;
    const bool is_last = i + 1 == heard.size() || heard[i + 1].node != heard[i].node;
    if (is_first && is_last) heard[i].is_duplicate = false;
  }
  return heard;
}

}  // namespace swarmtalk::daemon
