#include "drivers/link/framer.hpp"

#include <algorithm>
#include <array>

namespace swarmtalk::drivers {
namespace {

// Packets that fit nowhere, dropped in one call; the rest waits for the next, so that a link with a
// tiny MTU does not spin here.
constexpr int kMaxDropsPerFrame = 64;
// Of a beacon: 768 bytes. What has no room comes with the next.
constexpr std::size_t kMostLastMessages = 128;

void count(frame::ParseResult result, LinkCounters& counters) {
  switch (result) {
    case frame::ParseResult::kOk:
      break;
    case frame::ParseResult::kNotOurs:
      ++counters.frames_not_ours;
      break;
    case frame::ParseResult::kOtherVersion:
      ++counters.frames_other_version;
      break;
    case frame::ParseResult::kUnknownFlags:
      ++counters.frames_unknown_flags;
      break;
    case frame::ParseResult::kTruncated:
      ++counters.frames_truncated;
      break;
    case frame::ParseResult::kSealed:
      ++counters.frames_sealed;
      break;
    case frame::ParseResult::kWithoutKey:
      ++counters.frames_without_key;
      break;
    case frame::ParseResult::kOtherKey:
      ++counters.frames_other_key;
      break;
    case frame::ParseResult::kReplayed:
      ++counters.frames_replayed;
      break;
    case frame::ParseResult::kNotAuthentic:
      ++counters.frames_not_authentic;
      break;
  }
}

}  // namespace

FrameBuilder::FrameBuilder(frame::ProfileId profile, std::size_t max_packet_bytes)
    : profile_(profile), max_packet_bytes_(max_packet_bytes) {}

std::size_t FrameBuilder::buffer_bytes(std::size_t limit_bytes) const {
  return std::max(limit_bytes, frame::kHeaderBytes + frame::kPoseBytes + frame::kSealBytes) +
         frame::kLengthPrefixBytes + max_packet_bytes_;
}

frame::FrameHeader FrameBuilder::next_header(LinkUser& user) {
  if (sealer_ && frames_built_ == UINT32_MAX) {  // no nonce twice
    sealer_->draw_session();
    frames_built_ = 0;
  }
  frame::FrameHeader header = user.frame_header();
  header.profile = profile_;
  header.counter = frames_built_ + 1;
  return header;
}

BuiltFrame FrameBuilder::build_beacon(LinkUser& user, std::span<std::uint8_t> buffer,
                                      std::size_t limit_bytes) {
  frame::FrameHeader header = next_header(user);
  const std::size_t around = header.size_bytes() + (sealer_ ? frame::kSealBytes : std::size_t{0});
  if (around > limit_bytes) return {};
  std::array<frame::LastMessage, kMostLastMessages> last;
  const std::size_t fit = (limit_bytes - around) / frame::kLastMessageBytes;
  const std::size_t count = user.last_messages(std::span(last).first(std::min(fit, last.size())));
  header.is_beacon = count > 0;
  frame::FrameWriter writer(buffer, header, limit_bytes, sealer_ ? &*sealer_ : nullptr);
  for (std::size_t i = 0; i < count; ++i) writer.append_last(last[i]);
  ++frames_built_;
  return {writer.finish().size(), 0, false};
}

BuiltFrame FrameBuilder::build(LinkUser& user, std::span<std::uint8_t> buffer,
                               std::size_t limit_bytes, LinkCounters& counters) {
  const frame::FrameHeader header = next_header(user);
  frame::FrameWriter writer(buffer, header, limit_bytes, sealer_ ? &*sealer_ : nullptr);
  bool more_waits = true;
  for (int drops = 0; drops < kMaxDropsPerFrame;) {
    const std::span<std::uint8_t> room = writer.room();
    const std::size_t left = std::min(writer.left_bytes(), room.size());
    if (writer.commit(user.pull_packet(room.first(left)))) continue;
    more_waits = user.next_packet_bytes() > 0;
    if (!more_waits || writer.packets() > 0) break;
    user.pull_packet(room);
    ++counters.packets_over_mtu;
    ++drops;
  }
  if (writer.packets() == 0) return {0, 0, more_waits};
  ++frames_built_;
  return {writer.finish().size(), writer.packets(), more_waits};
}

void FrameReceiver::receive(std::span<const std::uint8_t> bytes, const FrameArrival& arrival,
                            LinkUser& user, LinkCounters& counters) {
  frame::Frame frame;
  const frame::ParseResult result = opener_.open(bytes, frame);
  const bool has_header =
      result == frame::ParseResult::kOk || result == frame::ParseResult::kReplayed;
  if (has_header && user.is_own_frame(frame.header)) {  // come back by way of a repeater
    ++counters.own_echoes;
    return;
  }
  if (result != frame::ParseResult::kOk) return count(result, counters);
  if (frame.header.profile != profile_) {
    ++counters.frames_other_profile;
    return;
  }
  ++counters.frames_received;
  counters.bytes_received += frame.size_bytes;
  const FrameReception reception{frame.header.node,    frame.header.epoch,    frame.header.counter,
                                 frame.header.pose,    arrival.received_at,   {},
                                 arrival.kernel_drops, arrival.is_time_known, arrival.hardware};
  frame::PacketReader reader(frame.packets);
  for (std::span<const std::uint8_t> packet; reader.next(packet);) {
    ++counters.packets_received;
    user.on_packet(packet, reception);
  }
  frame::LastMessageReader beacon(frame.last_messages);
  for (frame::LastMessage last; beacon.next(last);) user.on_last_message(last, reception);
  if (reader.is_malformed() || beacon.is_malformed()) ++counters.frames_bad_packet_length;
  user.on_frame(reception);
}

void use_key(const std::shared_ptr<const frame::SwarmKey>& key, FrameBuilder& builder,
             FrameReceiver& receiver) {
  frame::Opener opener(key);
  std::optional<frame::Sealer> sealer;
  if (key != nullptr) {
    sealer.emplace(key);
    opener.refuse(sealer->session());
  }
  builder.set_sealer(std::move(sealer));
  receiver.set_opener(std::move(opener));
}

}  // namespace swarmtalk::drivers
