#include "redundancy/repair_sender.hpp"

#include <algorithm>
#include <utility>

#include "redundancy/wifi_packet.hpp"

namespace swarmtalk::redundancy {
namespace {

std::size_t put(const Bytes& packet, std::uint64_t waited_us, std::span<std::uint8_t> out) {
  std::copy(packet.begin(), packet.end(), out.begin());
  add_wait(out.first(packet.size()), waited_us);
  return packet.size();
}

}  // namespace

void RepairSender::protect(std::uint16_t channel, std::uint32_t number, unsigned repairs) {
  Protected& message = protected_[channel];
  message.number = number;
  message.repairs = repairs;
  message.is_made = false;
  message.sums.clear();
}

void RepairSender::forget(std::uint16_t channel) {
  protected_.erase(channel);
  for (Copy& copy : copies_) copy.is_held = copy.is_held && !copy.is_of(channel);
}

bool RepairSender::Copy::is_of(std::uint16_t channel) const {
  return Wire::ChannelField::get(packet.data()) == channel;
}

void RepairSender::repeats(std::uint16_t channel) {
  const auto found = protected_.find(channel);
  if (found == protected_.end()) return;
  for (Copy& copy : copies_) {
    if (!copy.is_of(channel)) continue;
    copy.is_held = Wire::MessageField::get(copy.packet.data()) == found->second.number;
  }
}

// They have left in this frame, as it were.
void RepairSender::release_copies(std::uint16_t channel, std::uint64_t frame,
                                  std::uint64_t now_us) {
  std::deque<Copy> held;
  for (auto copy = copies_.begin(); copy != copies_.end();) {
    if (!copy->is_held || !copy->is_of(channel)) {
      ++copy;
      continue;
    }
    held.push_back(std::move(*copy));
    copy = copies_.erase(copy);
  }
  for (Copy& copy : held) {
    copy.is_held = false;
    copy.last_frame = frame;
    copy.due_us = now_us + copy_wait_us_;
    keep_copy(std::move(copy));
  }
}

void RepairSender::sent(std::span<std::uint8_t> packet, std::uint64_t frame, std::uint64_t now_us) {
  const Header header = Wire::decode(packet.data());
  const auto found = protected_.find(header.channel);
  if (found == protected_.end() || header.hops != 0) return;
  Protected& message = found->second;
  if (message.number != header.message) {
    // A later message that asked for nothing.
    if (message.is_made || header.message - message.number < UINT32_MAX / 2) {
      protected_.erase(found);
    }
    return;
  }
  const unsigned sources = source_packets(header);
  if (sources == 1) {
    if (std::exchange(message.is_made, true)) {
      release_copies(header.channel, frame, now_us);
    } else {
      Copy copy;
      copy.packet.assign(packet.begin(), packet.end());
      copy.since_us = now_us;
      copy.due_us = now_us + copy_wait_us_;
      copy.last_frame = frame;
      copy.left = message.repairs;
      keep_copy(std::move(copy));
    }
    return;
  }
  ParitiesField::put(packet.data(), static_cast<std::uint8_t>(message.repairs));
  if (message.is_made) return;  // a copy of the whole message
  if (header.sequence == 0) {
    message.sums.assign(message.repairs, Bytes(payload_max(header)));
  }
  for (unsigned parity = 0; parity < message.sums.size(); ++parity) {
    add_product(message.sums[parity], payload(packet, header),
                coefficient(parity, header.sequence));
  }
  if (header.end) make_parities(message, packet, now_us);
}

void RepairSender::make_parities(Protected& message, std::span<const std::uint8_t> last,
                                 std::uint64_t now_us) {
  const Header header = Wire::decode(last.data());
  message.is_made = true;
  for (unsigned parity = 0; parity < message.sums.size(); ++parity) {
    if (parities_.size() == kMostParities) {
      parities_.pop_front();
      ++dropped_;
    }
    Waiting& made = parities_.emplace_back();
    made.since_us = now_us;
    made.packet.assign(last.begin(), last.begin() + Wire::kHeaderBytes);
    Wire::SequenceField::put(made.packet.data(),
                             static_cast<Wire::Sequence>(source_packets(header) + parity));
    Wire::EndField::put(made.packet.data(), 0);
    const Bytes& sum = message.sums[parity];
    made.packet.insert(made.packet.end(), sum.begin(), sum.end());
    made.packet.insert(made.packet.end(),
                       last.end() - static_cast<std::ptrdiff_t>(timestamp_bytes(header)),
                       last.end());
  }
  message.sums.clear();
}

std::size_t RepairSender::take_parity(std::span<std::uint8_t> out, std::uint64_t now_us) {
  const Waiting parity = std::move(parities_.front());
  parities_.pop_front();
  ++sent_;
  return put(parity.packet, now_us - parity.since_us, out);
}

void RepairSender::keep_copy(Copy copy) {
  if (copies_.size() == kMostCopies) {
    dropped_ += copies_.front().left;
    copies_.pop_front();
  }
  const std::uint64_t from_us = copies_.empty() ? 0 : copies_.back().due_us;
  copy.due_us = std::max(copy.due_us, from_us);
  copies_.push_back(std::move(copy));
}

std::optional<std::size_t> RepairSender::copy_bytes(std::uint64_t frame) const {
  for (const Copy& copy : copies_) {
    if (copy.may_leave(frame)) return copy.packet.size();
  }
  return std::nullopt;
}

std::optional<std::uint64_t> RepairSender::next_due_us() const {
  const auto found =
      std::find_if(copies_.begin(), copies_.end(), [](const Copy& copy) { return !copy.is_held; });
  if (found == copies_.end()) return std::nullopt;
  return found->due_us;
}

std::size_t RepairSender::take_copy(std::span<std::uint8_t> out, std::uint64_t frame,
                                    std::uint64_t now_us) {
  const auto found = std::find_if(copies_.begin(), copies_.end(),
                                  [&](const Copy& copy) { return copy.may_leave(frame); });
  Copy copy = std::move(*found);
  copies_.erase(found);
  const std::size_t bytes = put(copy.packet, now_us - copy.since_us, out);
  ++sent_;
  if (--copy.left > 0) {
    copy.last_frame = frame;
    copy.due_us = now_us + copy_wait_us_;
    keep_copy(std::move(copy));
  }
  return bytes;
}

}  // namespace swarmtalk::redundancy
