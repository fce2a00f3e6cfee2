#include "daemon/hub/seen_messages.hpp"

namespace swarmtalk::daemon {
namespace {

using namespace std::chrono_literals;

// Copies by another way come within a queue's length. Where numbers are few (a Kilobot's 16) they
// come back after some seconds, and with them a message that is only like the old one.
constexpr auto kMemory = 10s;
constexpr auto kShortMemory = 2s;

void mix(std::uint64_t& hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9E3779B97F4A7C15u;
  hash ^= hash >> 32;
}

std::uint64_t key_of(const SeenMessages::Identity& identity) {
  std::uint64_t hash = 14695981039346656037u;
  for (const std::uint8_t byte : identity.payload) hash = (hash ^ byte) * 1099511628211u;
  mix(hash,
      identity.node | std::uint64_t{identity.epoch} << 16 | std::uint64_t{identity.number} << 32);
  mix(hash, identity.channel);
  return hash;
}

}  // namespace

bool SeenMessages::came_otherwise(const Identity& identity, Way way, Time now) {
  const std::uint64_t key = key_of(identity);
  const auto [found, is_new] = seen_.try_emplace(key, Seen{way, now});
  if (!is_new) {
    const auto memory = identity.epoch == 0 ? kShortMemory : kMemory;
    if (found->second.way != way && now - found->second.at < memory) return true;
    found->second = {way, now};
    return false;
  }
  if (ring_.size() < kMost) {
    ring_.push_back(key);
    return false;
  }
  seen_.erase(ring_[oldest_]);
  ring_[oldest_] = key;
  oldest_ = (oldest_ + 1) % kMost;
  return false;
}

}  // namespace swarmtalk::daemon
