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
    case frame::ParseResult::kNotFresh:
      ++counters.frames_not_fresh;
      break;
    case frame::ParseResult::kReplayed:
      ++counters.frames_replayed;
      break;
    case frame::ParseResult::kNotProven:
      ++counters.frames_not_proven;
      break;
    case frame::ParseResult::kTooOld:
      ++counters.frames_too_old;
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
  return std::max(limit_bytes, frame::kHeaderBytes + frame::kPoseBytes + frame::kSealBytes +
                                   frame::kFreshBytes) +
         frame::kLengthPrefixBytes + max_packet_bytes_;
}

frame::FrameHeader FrameBuilder::next_header(LinkUser& user, MonotonicTime now) {
  frame::FrameHeader header = user.frame_header();
  if (sealer_ && frames_built_ == UINT32_MAX) {  // no nonce twice
    sealer_->draw_session();
    frames_built_ = 0;
    if (freshness_ != nullptr) {
      freshness_->change_own(frame::voice_of(sealer_->session(), header.epoch), milliseconds(now));
    }
  }
  header.profile = profile_;
  header.counter = frames_built_ + 1;
  return header;
}

std::span<const std::uint8_t> FrameBuilder::fresh_bytes(const frame::FrameHeader& header,
                                                        std::size_t limit_bytes,
                                                        MonotonicTime now) {
  if (freshness_ == nullptr || !sealer_) return {};
  const std::size_t around = header.size_bytes() + frame::kSealBytes;
  const std::size_t left = limit_bytes > around ? limit_bytes - around : 0;
  if (left < frame::kFreshBytes) return {};  // no room for anything
  const frame::Freshness::Ms time = milliseconds(now);
  const std::size_t wanted = std::min(freshness_->wanted_bytes(time), left);
  fresh_.resize(std::max(wanted, frame::kFreshBytes));
  return std::span(fresh_).first(freshness_->write(time, fresh_));
}

BuiltFrame FrameBuilder::build_beacon(LinkUser& user, std::span<std::uint8_t> buffer,
                                      std::size_t limit_bytes, MonotonicTime now) {
  frame::FrameHeader header = next_header(user, now);
  std::size_t around = header.size_bytes() + (sealer_ ? frame::kSealBytes : std::size_t{0});
  if (freshness_ != nullptr) around += frame::kFreshBytes;
  if (around > limit_bytes) return {};
  const std::span<const std::uint8_t> fresh = fresh_bytes(header, limit_bytes, now);
  if (!fresh.empty()) around += fresh.size() - frame::kFreshBytes;
  std::array<frame::LastMessage, kMostLastMessages> last;
  const std::size_t fit = (limit_bytes - around) / frame::kLastMessageBytes;
  const std::size_t count = user.last_messages(std::span(last).first(std::min(fit, last.size())));
  header.is_beacon = count > 0;
  frame::FrameWriter writer(buffer, header, limit_bytes, sealer_ ? &*sealer_ : nullptr, fresh);
  for (std::size_t i = 0; i < count; ++i) writer.append_last(last[i]);
  ++frames_built_;
  return {writer.finish().size(), 0, false};
}

BuiltFrame FrameBuilder::build(LinkUser& user, std::span<std::uint8_t> buffer,
                               std::size_t limit_bytes, LinkCounters& counters, MonotonicTime now) {
  if (freshness_ != nullptr && user.next_packet_bytes() == 0) return {};
  const frame::FrameHeader header = next_header(user, now);
  const std::span<const std::uint8_t> fresh = fresh_bytes(header, limit_bytes, now);
  frame::FrameWriter writer(buffer, header, limit_bytes, sealer_ ? &*sealer_ : nullptr, fresh);
  bool more_waits = true;
  for (int drops = 0; drops < kMaxDropsPerFrame;) {
    const std::span<std::uint8_t> room = writer.room();
    const std::size_t left = std::min(writer.left_bytes(), room.size());
    if (writer.commit(user.pull_packet(room.first(left)))) continue;
    more_waits = user.next_packet_bytes() > 0;
    // A long packet leaves in the next frame, without the many nonces of this one.
    if (!more_waits || writer.packets() > 0 || fresh.size() > frame::kFreshBytes) break;
    user.pull_packet(room);
    ++counters.packets_over_mtu;
    ++drops;
  }
  if (writer.packets() == 0 && fresh.empty()) return {0, 0, more_waits};
  ++frames_built_;
  return {writer.finish().size(), writer.packets(), more_waits};
}

void FrameReceiver::receive(std::span<const std::uint8_t> bytes, const FrameArrival& arrival,
                            LinkUser& user, LinkCounters& counters) {
  frame::Frame frame;
  const frame::ParseResult result = opener_.open(bytes, frame, milliseconds(arrival.received_at));
  const bool has_header =
      result == frame::ParseResult::kOk || result == frame::ParseResult::kReplayed;
  if (has_header && user.is_own_frame(frame.header)) {  // come back by way of a repeater
    ++counters.own_echoes;
    return;
  }
  if (result == frame::ParseResult::kNotProven) keep(bytes, frame, arrival);
  if (result != frame::ParseResult::kOk) return count(result, counters);
  if (!held_.is_empty() && opener_.has_proven()) release(bytes, arrival, user, counters);
  hand_up(frame, arrival, user, counters);
}

void FrameReceiver::keep(std::span<const std::uint8_t> bytes, const frame::Frame& frame,
                         const FrameArrival& arrival) {
  if (!opener_.may_be_proven(bytes, milliseconds(arrival.received_at))) return;
  held_.keep({frame::Opener::voice_in(bytes),
              frame.header.counter,
              arrival,
              {bytes.begin(), bytes.end()}});
}

// What a robot said before the frame that shows that it lives, in front of that frame.
void FrameReceiver::release(std::span<const std::uint8_t> proof, const FrameArrival& arrival,
                            LinkUser& user, LinkCounters& counters) {
  for (HeldFrames::Held& held : held_.take(frame::Opener::voice_in(proof))) {
    frame::Frame frame;
    const frame::ParseResult result =
        opener_.open_held(held.bytes, frame, milliseconds(arrival.received_at));
    held.arrival.kernel_drops = arrival.kernel_drops;  // the count only grows
    if (result == frame::ParseResult::kOk) {
      if (hand_up(frame, held.arrival, user, counters)) ++counters.frames_proven_later;
    } else if (result == frame::ParseResult::kNotProven) {
      held_.keep(std::move(held));  // a later proof may tell more
    }
  }
}

bool FrameReceiver::hand_up(const frame::Frame& frame, const FrameArrival& arrival, LinkUser& user,
                            LinkCounters& counters) const {
  if (frame.header.profile != profile_) {
    ++counters.frames_other_profile;
    return false;
  }
  ++counters.frames_received;
  counters.bytes_received += frame.size_bytes;
  const FrameReception reception{
      frame.header.node,     frame.header.epoch,      frame.header.counter,
      frame.header.pose,     arrival.received_at,     {},
      arrival.kernel_drops,  arrival.is_time_known,   arrival.hardware,
      frame.header.is_ghost, arrival.has_our_hardware};
  frame::PacketReader reader(frame.packets);
  for (std::span<const std::uint8_t> packet; reader.next(packet);) {
    ++counters.packets_received;
    user.on_packet(packet, reception);
  }
  frame::LastMessageReader beacon(frame.last_messages);
  for (frame::LastMessage last; beacon.next(last);) user.on_last_message(last, reception);
  if (reader.is_malformed() || beacon.is_malformed()) ++counters.frames_bad_packet_length;
  user.on_frame(reception);
  return true;
}

void use_key(const std::shared_ptr<const frame::SwarmKey>& key, FrameBuilder& builder,
             FrameReceiver& receiver, const std::shared_ptr<const frame::SwarmKey>& also) {
  frame::Opener opener(key, also);
  std::optional<frame::Sealer> sealer;
  if (key != nullptr) {
    sealer.emplace(key);
    opener.refuse(sealer->session());
  }
  builder.set_sealer(std::move(sealer));
  builder.set_freshness(nullptr);
  receiver.set_opener(std::move(opener));
}

void use_key_freshly(const std::shared_ptr<const frame::SwarmKey>& key,
                     const std::shared_ptr<const frame::SwarmKey>& also, std::uint32_t epoch,
                     MonotonicTime now, std::shared_ptr<frame::Freshness>& freshness,
                     FrameBuilder& builder, FrameReceiver& receiver) {
  frame::Sealer* const sealer = builder.sealer();
  if (key != nullptr && freshness != nullptr && sealer != nullptr) {
    sealer->change_key(key);
    receiver.opener().change_keys(key, also);
    return;
  }
  use_key(key, builder, receiver, also);
  freshness.reset();
  if (key == nullptr) return;
  freshness = std::make_shared<frame::Freshness>(
      frame::voice_of(builder.sealer()->session(), epoch), milliseconds(now), frame::draw_random);
  builder.set_freshness(freshness);
  receiver.opener().check_freshness(freshness);
}

}  // namespace swarmtalk::drivers
