#include "daemon/common/followed_count.hpp"

#include <algorithm>

namespace swarmtalk::daemon {
namespace {

constexpr double kNsPerS = 1e9;

bool is_ahead(std::uint32_t distance) {
  return distance != 0 && distance <= UINT32_MAX / 2;
}

}  // namespace

double FollowedCount::Pace::hz(std::uint64_t now_ns) const {
  const std::uint64_t counted =
      std::min<std::uint64_t>(advanced, std::uint64_t{heard} * kMostSteps);
  const std::uint64_t passed_ns = std::max(now_ns - std::min(now_ns, begin_ns), kPaceNs);
  return static_cast<double>(counted) * kNsPerS / static_cast<double>(passed_ns);
}

double FollowedCount::hz(std::uint64_t now_ns) const {
  return std::max(most_hz_, pace_.hz(now_ns));
}

// While the robot is heard, no more adds up than what it can send in kPaceNs.
double FollowedCount::believable(std::uint64_t now_ns) const {
  const double per_ns = kBelievedTimesRate * hz(heard_ns_) / kNsPerS;
  const double used = std::max(0.0, used_ - per_ns * static_cast<double>(heard_ns_ - used_ns_));
  const double at_once = std::max<double>(kBelieved, per_ns * kPaceNs);
  return at_once - used + per_ns * static_cast<double>(now_ns - std::min(now_ns, heard_ns_));
}

// The usual step costs an addition or two: all else is looked up when something is missing.
void FollowedCount::go_to(std::uint32_t number, std::uint64_t taken, std::uint64_t now_ns) {
  now_ns = std::max(now_ns, heard_ns_);
  if (taken != 0 || used_ != 0) {
    const double per_ns = kBelievedTimesRate * hz(now_ns) / kNsPerS;
    const double sent = per_ns * static_cast<double>(now_ns - used_ns_);
    used_ = std::max(0.0, used_ + static_cast<double>(taken) - sent);
  }
  highest_ = heard_ = number;
  heard_ns_ = used_ns_ = now_ns;
  if (now_ns - pace_.begin_ns < kPaceNs) return;
  most_hz_ = hz(now_ns);
  pace_ = {now_ns, 0, 0};
}

FollowedCount::Step FollowedCount::heard(std::uint32_t number, std::uint64_t explained,
                                         std::uint64_t now_ns) {
  const std::uint32_t ahead = number - highest_;
  if (ahead == 1) {  // nothing is missing
    elsewhere_.pace.heard = 0;
    is_heard_ = true;
    ++pace_.heard;
    pace_.advanced += number - heard_;
    go_to(number, 0, now_ns);
    return {Place::kAhead, 1, 0};
  }
  if (!is_ahead(ahead)) {
    const std::uint32_t behind = highest_ - number;
    if (!is_heard_ && behind != 0) {
      begin_at(number, now_ns);
      return {Place::kBack, behind, 0};
    }
    is_heard_ = true;
    if (behind > kFollowed) return doubt(number, explained, now_ns);
    elsewhere_.pace.heard = 0;
    ++pace_.heard;
    if (is_ahead(number - heard_)) {  // a beacon had told of it
      pace_.advanced += number - heard_;
      heard_ = number;
    }
    return {Place::kBehind, behind, 0};
  }
  const std::uint64_t missing = ahead - 1;
  const std::uint64_t believed =
      explained + static_cast<std::uint64_t>(std::max(0.0, believable(now_ns)));
  if (missing > believed) {
    if (!is_heard_) return begin_at(number, now_ns);
    if (missing > kFollowed) return doubt(number, explained, now_ns);
  }
  is_heard_ = true;
  elsewhere_.pace.heard = 0;
  ++pace_.heard;
  const std::uint64_t taken = std::min(missing, believed);
  pace_.advanced += std::min(number - heard_, static_cast<std::uint32_t>(taken) + 1);
  go_to(number, taken - std::min(taken, explained), now_ns);
  return {Place::kAhead, ahead, static_cast<std::uint32_t>(taken)};
}

FollowedCount::Step FollowedCount::begin_at(std::uint32_t number, std::uint64_t now_ns) {
  *this = FollowedCount(number, now_ns, true);
  return {Place::kElsewhere, 0, 0};
}

// One number says little: anybody may have made it up, and who spoke before goes on where he was.
FollowedCount::Step FollowedCount::doubt(std::uint32_t number, std::uint64_t explained,
                                         std::uint64_t now_ns) {
  const std::uint32_t step = number - elsewhere_.number;
  if (elsewhere_.pace.heard == 0 || !is_ahead(step)) {
    elsewhere_ = {number, {now_ns, 1, 0}};
    return {};
  }
  elsewhere_.number = number;
  ++elsewhere_.pace.heard;
  elsewhere_.pace.advanced += step <= kFollowed ? step : 1;
  const std::uint32_t ahead = number - highest_;
  const std::uint64_t patience_ns = is_ahead(ahead) ? kElsewhereNs : kBackNs;
  if (now_ns - std::min(now_ns, elsewhere_.pace.begin_ns) < patience_ns) return {};
  most_hz_ = std::max(most_hz_, elsewhere_.pace.hz(now_ns));
  const std::uint32_t heard_there = std::min(ahead, elsewhere_.pace.heard);
  elsewhere_ = {};
  Step made{Place::kElsewhere, 0, 0};
  std::uint64_t taken = 0;
  if (is_ahead(ahead)) {
    const double believed = static_cast<double>(explained) + believable(now_ns);
    taken = static_cast<std::uint64_t>(std::clamp<double>(believed, 0, ahead - heard_there));
    made = {Place::kElsewhere, ahead, static_cast<std::uint32_t>(taken)};
  }
  go_to(number, taken - std::min(taken, explained), now_ns);
  return made;
}

FollowedCount::Step FollowedCount::told(std::uint32_t number, std::uint64_t now_ns) {
  const std::uint32_t ahead = number - highest_;
  if (!is_ahead(ahead)) return {Place::kBehind, highest_ - number, 0};
  if (static_cast<double>(ahead) > believable(now_ns)) return {};
  const double per_ns = kBelievedTimesRate * hz(heard_ns_) / kNsPerS;
  used_ = std::max(0.0, used_ - per_ns * static_cast<double>(heard_ns_ - used_ns_)) + ahead;
  used_ns_ = heard_ns_;
  highest_ = number;
  return {Place::kAhead, ahead, ahead};
}

void FollowedCount::came_late() {
  used_ = std::max(0.0, used_ - 1.0);
}

std::uint32_t FollowedCount::believe_now(std::uint32_t doubted) {
  const double believed = std::clamp<double>(believable(heard_ns_), 0, doubted);
  const auto taken = static_cast<std::uint32_t>(believed);
  if (taken != 0) go_to(highest_, taken, heard_ns_);
  return taken;
}

}  // namespace swarmtalk::daemon
