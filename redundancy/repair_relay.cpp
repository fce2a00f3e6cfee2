#include "redundancy/repair_relay.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::redundancy {

std::size_t RepairRelay::Hash::operator()(const MessageName& name) const {
  const std::uint64_t sender =
      std::uint64_t{name.node} << 32 | std::uint64_t{name.epoch} << 16 | name.channel;
  return static_cast<std::size_t>(
      (sender * 0x9E3779B97F4A7C15u ^ name.number) * 0xD6E8FEB86659FD93u >> 17);
}

void RepairRelay::offer(std::span<const std::uint8_t> packet, const Header& header,
                        std::uint64_t now_us) {
  if (header.ttl == 0 || max_ttl_ == 0) return;
  if (!is_new(header, now_us)) return;
  if (waiting_.size() == kMostWaiting) {
    ++dropped_;
    return;
  }
  Header limited = header;
  limited.ttl = std::min(header.ttl, max_ttl_);
  Waiting& waiting = waiting_.emplace_back();
  waiting.packet.assign(packet.begin(), packet.end());
  waiting.since_us = now_us;
  Wire::count_hop(waiting.packet.data(), limited);
}

// Without memory for its name it counts as seen: rather not at all than twice.
bool RepairRelay::is_new(const Header& header, std::uint64_t now_us) {
  forget_old(now_us);
  const std::uint32_t bit = 1u << (header.sequence - source_packets(header));
  const MessageName name = name_of(header);
  const auto found = seen_.find(name);
  if (found != seen_.end()) {
    const bool is_first = (found->second & bit) == 0;
    found->second |= bit;
    return is_first;
  }
  if (seen_.size() == kMostRemembered) {
    ++dropped_;
    return false;
  }
  seen_.emplace(name, bit);
  in_order_.emplace_back(now_us, name);
  return true;
}

void RepairRelay::forget_old(std::uint64_t now_us) {
  while (!in_order_.empty() && now_us - in_order_.front().first > kRememberUs) {
    seen_.erase(in_order_.front().second);
    in_order_.pop_front();
  }
}

void RepairRelay::drop_late(std::uint64_t now_us) {
  if (max_wait_us_ == 0) return;
  while (!waiting_.empty() && now_us - waiting_.front().since_us > max_wait_us_) {
    waiting_.pop_front();
    ++dropped_;
  }
}

std::size_t RepairRelay::take(std::span<std::uint8_t> out, std::uint64_t now_us) {
  const Waiting next = std::move(waiting_.front());
  waiting_.pop_front();
  ++forwarded_;
  std::copy(next.packet.begin(), next.packet.end(), out.begin());
  add_wait(out.first(next.packet.size()), now_us - next.since_us);
  return next.packet.size();
}

}  // namespace swarmtalk::redundancy
