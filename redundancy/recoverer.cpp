#include "redundancy/recoverer.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::redundancy {

std::vector<Bytes> Recoverer::add(std::span<const std::uint8_t> packet, const Header& header,
                                  std::uint64_t now_us) {
  Message* const message = message_of(header, now_us);
  if (message == nullptr || message->is_done) return {};
  if (!hold(*message, packet, header, now_us)) return {};
  if (message->held + message->parities.size() < message->sources.size()) return {};
  std::vector<Bytes> packets = complete(*message, now_us);
  message->is_done = true;
  drop_packets(*message);
  recovered_ += packets.size();
  return packets;
}

// Null: it contradicts what is held under its name.
Recoverer::Message* Recoverer::message_of(const Header& header, std::uint64_t now_us) {
  const MessageName name = name_of(header);
  const auto found = std::find_if(messages_.begin(), messages_.end(),
                                  [&](const Message& message) { return message.name == name; });
  if (found != messages_.end() && now_us - found->heard_us <= kLifeUs) {
    const bool is_alike = found->size == header.size && found->has_delay == header.has_delay;
    return is_alike ? &*found : nullptr;
  }
  make_room(now_us);
  Message& made = messages_.emplace_back();
  made.name = name;
  made.size = header.size;
  made.has_delay = header.has_delay;
  made.heard_us = now_us;
  made.sources.resize(source_packets(header));
  return &made;
}

void Recoverer::make_room(std::uint64_t now_us) {
  std::erase_if(messages_, [&](Message& message) {
    if (now_us - message.heard_us <= kLifeUs) return false;
    drop_packets(message);
    return true;
  });
  while (messages_.size() >= kMostMessages || held_bytes_ >= kMostBytes) {
    const auto longest = std::min_element(
        messages_.begin(), messages_.end(),
        [](const Message& a, const Message& b) { return a.heard_us < b.heard_us; });
    if (!longest->is_done) ++evicted_;
    drop_packets(*longest);
    messages_.erase(longest);
  }
}

void Recoverer::drop_packets(Message& message) {
  for (Bytes& source : message.sources) held_bytes_ -= std::exchange(source, {}).size();
  for (Parity& parity : message.parities) held_bytes_ -= parity.bytes.size();
  message.parities.clear();
}

// @return whether it is one more.
bool Recoverer::hold(Message& message, std::span<const std::uint8_t> packet, const Header& header,
                     std::uint64_t now_us) {
  const std::span<const std::uint8_t> bytes = payload(packet, header);
  const auto sources = static_cast<unsigned>(message.sources.size());
  if (header.sequence < sources) {
    Bytes& source = message.sources[header.sequence];
    if (!source.empty()) return false;
    source.assign(bytes.begin(), bytes.end());
    ++message.held;
  } else {
    const unsigned index = header.sequence - sources;
    const bool is_held = std::any_of(message.parities.begin(), message.parities.end(),
                                     [&](const Parity& parity) { return parity.index == index; });
    if (is_held) return false;
    message.parities.push_back({index, Bytes(bytes.begin(), bytes.end())});
    message.head.assign(packet.begin(), packet.begin() + Wire::kHeaderBytes);
    message.tail.assign(packet.end() - static_cast<std::ptrdiff_t>(timestamp_bytes(header)),
                        packet.end());
    message.tail_us = now_us;
  }
  held_bytes_ += bytes.size();
  message.heard_us = now_us;
  return true;
}

// What is made known came, as far as delay, hops and TTL go, with the last parity packet.
std::vector<Bytes> Recoverer::complete(Message& message, std::uint64_t now_us) {
  std::vector<std::span<const std::uint8_t>> sources;
  for (const Bytes& source : message.sources) {
    sources.push_back(source.empty() ? std::span<const std::uint8_t>() : std::span(source));
  }
  std::vector<Bytes> missing = recover(sources, message.parities);
  std::vector<Bytes> packets;
  std::size_t next = 0;
  for (std::size_t place = 0; place < sources.size() && next < missing.size(); ++place) {
    if (sources[place].data() != nullptr) continue;
    Bytes& bytes = missing[next++];
    const std::size_t full = bytes.size();
    const bool is_end = place + 1 == sources.size();
    if (is_end) bytes.resize(message.size - place * full);
    Bytes& packet = packets.emplace_back(message.head);
    Wire::SequenceField::put(packet.data(), static_cast<Wire::Sequence>(place));
    Wire::EndField::put(packet.data(), is_end ? 1 : 0);
    packet.insert(packet.end(), bytes.begin(), bytes.end());
    packet.insert(packet.end(), message.tail.begin(), message.tail.end());
    add_wait(packet, now_us - message.tail_us);
  }
  return packets;
}

}  // namespace swarmtalk::redundancy
