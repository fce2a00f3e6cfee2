#include "frame/air_frame.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "frame/sealing.hpp"

namespace swarmtalk::frame {
namespace {

// Offsets of the fields, in bytes from the magic.
constexpr std::size_t kMagicAt = 0;
constexpr std::size_t kVersionAt = 2;
constexpr std::size_t kFlagsAt = 3;
constexpr std::size_t kLengthAt = 4;
constexpr std::size_t kProfileAt = 6;
constexpr std::size_t kMarksAt = 7;
constexpr std::size_t kPoseAt = kHeaderBytes;

constexpr std::uint16_t kMagic = 0x5354;  // "ST"
constexpr std::uint8_t kMarkGhost = 0x01;
constexpr std::uint8_t kFlagPose = 0x01;
constexpr std::uint8_t kFlagSealed = 0x02;
constexpr std::uint8_t kFlagBeacon = 0x04;
constexpr std::uint8_t kFlagFresh = 0x08;  // of sealed ones only
constexpr std::uint8_t kKnownFlags = kFlagPose | kFlagSealed | kFlagBeacon | kFlagFresh;

constexpr double kStepsPerTurn = 65536.0;

void put_u16(std::uint8_t* at, std::uint16_t value) {
  at[0] = static_cast<std::uint8_t>(value >> 8);
  at[1] = static_cast<std::uint8_t>(value);
}

void put_u32(std::uint8_t* at, std::uint32_t value) {
  put_u16(at, static_cast<std::uint16_t>(value >> 16));
  put_u16(at + 2, static_cast<std::uint16_t>(value));
}

std::uint16_t get_u16(const std::uint8_t* at) {
  return static_cast<std::uint16_t>((at[0] << 8) | at[1]);
}

std::uint32_t get_u32(const std::uint8_t* at) {
  return (std::uint32_t{get_u16(at)} << 16) | get_u16(at + 2);
}

void put_pose(std::uint8_t* at, const FramePose& pose) {
  put_u16(at, static_cast<std::uint16_t>(pose.x_mm));
  put_u16(at + 2, static_cast<std::uint16_t>(pose.y_mm));
  put_u16(at + 4, pose.theta_turns16);
  at[6] = pose.age_10ms;
}

FramePose get_pose(const std::uint8_t* at) {
  return {static_cast<std::int16_t>(get_u16(at)), static_cast<std::int16_t>(get_u16(at + 2)),
          get_u16(at + 4), at[6]};
}

}  // namespace

FramePose FramePose::from_metres(double x_m, double y_m, double theta_rad, double age_s) {
  const double x = std::round(x_m * 1000.0);
  const double y = std::round(y_m * 1000.0);
  const double turns = theta_rad / (2.0 * std::numbers::pi);
  // Written so that NaN fails each test.
  const bool is_known = std::abs(x) <= kMaxMm && std::abs(y) <= kMaxMm && std::isfinite(turns) &&
                        std::isfinite(age_s);
  if (!is_known) return stale();
  const double steps = std::round((turns - std::floor(turns)) * kStepsPerTurn);
  const double age = std::clamp(std::round(age_s * 100.0), 0.0, double{kOldest});
  return {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
          static_cast<std::uint16_t>(static_cast<std::uint32_t>(steps)),
          static_cast<std::uint8_t>(age)};
}

double FramePose::theta_rad() const {
  const double turns = theta_turns16 / kStepsPerTurn;
  return (turns > 0.5 ? turns - 1.0 : turns) * 2.0 * std::numbers::pi;
}

FrameWriter::FrameWriter(std::span<std::uint8_t> buffer, const FrameHeader& header,
                         std::size_t limit_bytes, const Sealer* sealer,
                         std::span<const std::uint8_t> fresh)
    : buffer_(buffer),
      limit_bytes_(std::min({limit_bytes, buffer.size(), kMaxFrameBytes})),
      sealer_(sealer),
      size_bytes_(header.size_bytes()) {
  std::uint8_t* const at = buffer_.data();
  put_u16(at + kMagicAt, kMagic);
  at[kVersionAt] = kVersion;
  at[kFlagsAt] = header.pose ? kFlagPose : 0;
  if (header.is_beacon) at[kFlagsAt] |= kFlagBeacon;
  at[kProfileAt] = static_cast<std::uint8_t>(header.profile);
  at[kMarksAt] = header.is_ghost ? kMarkGhost : 0;
  put_u16(at + kNodeAt, header.node);
  put_u32(at + kEpochAt, header.epoch);
  put_u32(at + kCounterAt, header.counter);
  std::size_t pose_at = kPoseAt;
  if (sealer_ != nullptr) {
    at[kFlagsAt] |= kFlagSealed;
    pose_at = kSealedHeaderBytes;
    size_bytes_ += kSealedHeaderBytes - kHeaderBytes + fresh.size();
    if (!fresh.empty()) {
      at[kFlagsAt] |= kFlagFresh;
      std::copy(fresh.begin(), fresh.end(), at + pose_at);
      pose_at += fresh.size();
    }
    limit_bytes_ -= std::min(limit_bytes_, kTagBytes);
  }
  if (header.pose) put_pose(at + pose_at, *header.pose);
}

std::span<std::uint8_t> FrameWriter::room() const {
  if (buffer_.size() - size_bytes_ <= kLengthPrefixBytes) return {};
  return buffer_.subspan(size_bytes_ + kLengthPrefixBytes);
}

bool FrameWriter::commit(std::size_t packet_bytes) {
  if (packet_bytes == 0 || packet_bytes > limit_bytes_) return false;
  if (size_bytes_ + kLengthPrefixBytes + packet_bytes > limit_bytes_) return false;
  put_u16(buffer_.data() + size_bytes_, static_cast<std::uint16_t>(packet_bytes));
  size_bytes_ += kLengthPrefixBytes + packet_bytes;
  ++packets_;
  return true;
}

bool FrameWriter::append(std::span<const std::uint8_t> packet) {
  const std::span<std::uint8_t> to = room();
  if (packet.empty() || packet.size() > to.size()) return false;
  std::memcpy(to.data(), packet.data(), packet.size());
  return commit(packet.size());
}

bool FrameWriter::append_last(const LastMessage& last) {
  if (size_bytes_ + kLastMessageBytes > limit_bytes_) return false;
  put_u16(buffer_.data() + size_bytes_, last.channel);
  put_u32(buffer_.data() + size_bytes_ + 2, last.number);
  size_bytes_ += kLastMessageBytes;
  return true;
}

std::span<const std::uint8_t> FrameWriter::finish() {
  const std::size_t total_bytes = size_bytes_ + (sealer_ != nullptr ? kTagBytes : 0);
  put_u16(buffer_.data() + kLengthAt, static_cast<std::uint16_t>(total_bytes));
  const std::span<std::uint8_t> frame = buffer_.first(total_bytes);
  if (sealer_ != nullptr) sealer_->seal(frame);
  return frame;
}

std::string_view counter_name(ParseResult result) {
  switch (result) {
    case ParseResult::kOk:
      return {};
    case ParseResult::kNotOurs:
      return "frames_not_ours";
    case ParseResult::kOtherVersion:
      return "frames_other_version";
    case ParseResult::kUnknownFlags:
      return "frames_unknown_flags";
    case ParseResult::kTruncated:
      return "frames_truncated";
    case ParseResult::kSealed:
      return "frames_sealed";
    case ParseResult::kWithoutKey:
      return "frames_without_key";
    case ParseResult::kOtherKey:
      return "frames_other_key";
    case ParseResult::kNotFresh:
      return "frames_not_fresh";
    case ParseResult::kReplayed:
      return "frames_replayed";
    case ParseResult::kNotProven:
      return "frames_not_proven";
    case ParseResult::kTooOld:
      return "frames_too_old";
    case ParseResult::kNotAuthentic:
      return "frames_not_authentic";
  }
  return {};
}

void SealedFrame::read_plaintext(std::span<const std::uint8_t> plaintext, Frame& frame) const {
  frame.header.pose.reset();
  if (has_pose) frame.header.pose = get_pose(plaintext.data());
  (frame.header.is_beacon ? frame.last_messages : frame.packets) =
      plaintext.subspan(has_pose ? kPoseBytes : 0);
}

ParseResult parse(std::span<const std::uint8_t> bytes, Frame& frame, SealedFrame* sealed) {
  const std::uint8_t* const at = bytes.data();
  if (bytes.size() < kVersionAt || get_u16(at + kMagicAt) != kMagic) return ParseResult::kNotOurs;
  // Version and flags first: they say whether this code knows what the rest means.
  if (bytes.size() <= kVersionAt) return ParseResult::kTruncated;
  if (at[kVersionAt] != kVersion) return ParseResult::kOtherVersion;
  if (bytes.size() <= kFlagsAt) return ParseResult::kTruncated;
  const std::uint8_t flags = at[kFlagsAt];
  if ((flags & ~kKnownFlags) != 0) return ParseResult::kUnknownFlags;
  const bool is_fresh = (flags & kFlagFresh) != 0;
  if (is_fresh && (flags & kFlagSealed) == 0) return ParseResult::kUnknownFlags;
  if (bytes.size() < kHeaderBytes) return ParseResult::kTruncated;
  const bool has_pose = (flags & kFlagPose) != 0;
  const bool is_sealed = (flags & kFlagSealed) != 0;
  const std::size_t header_bytes = kHeaderBytes + (has_pose ? kPoseBytes : 0) +
                                   (is_sealed ? kSealBytes : 0) + (is_fresh ? kFreshBytes : 0);
  const std::size_t length = get_u16(at + kLengthAt);
  if (length < header_bytes || length > bytes.size()) return ParseResult::kTruncated;

  frame.header.profile = static_cast<ProfileId>(at[kProfileAt]);
  frame.header.node = get_u16(at + kNodeAt);
  frame.header.epoch = get_u32(at + kEpochAt);
  frame.header.counter = get_u32(at + kCounterAt);
  frame.size_bytes = length;
  frame.header.pose.reset();
  frame.header.is_beacon = (flags & kFlagBeacon) != 0;
  frame.header.is_ghost = (at[kMarksAt] & kMarkGhost) != 0;
  frame.packets = {};
  frame.last_messages = {};
  if (is_sealed) {
    const std::size_t plain_bytes = length - kSealedHeaderBytes - kTagBytes;
    if (sealed != nullptr) {
      *sealed = {bytes.subspan(kSealedHeaderBytes, plain_bytes),
                 bytes.subspan(length - kTagBytes, kTagBytes), has_pose, is_fresh};
    }
    return ParseResult::kSealed;
  }
  if (has_pose) frame.header.pose = get_pose(at + kPoseAt);
  (frame.header.is_beacon ? frame.last_messages : frame.packets) =
      bytes.subspan(header_bytes, length - header_bytes);
  return ParseResult::kOk;
}

bool PacketReader::next(std::span<const std::uint8_t>& packet) {
  if (rest_.empty()) return false;
  const std::size_t size = rest_.size() < kLengthPrefixBytes ? 0 : get_u16(rest_.data());
  if (size == 0 || size > rest_.size() - kLengthPrefixBytes) {
    is_malformed_ = true;
    rest_ = {};
    return false;
  }
  packet = rest_.subspan(kLengthPrefixBytes, size);
  rest_ = rest_.subspan(kLengthPrefixBytes + size);
  return true;
}

bool LastMessageReader::next(LastMessage& last) {
  if (rest_.size() < kLastMessageBytes) return false;
  last = {get_u16(rest_.data()), get_u32(rest_.data() + 2)};
  rest_ = rest_.subspan(kLastMessageBytes);
  return true;
}

std::vector<std::uint8_t> plain_copy(const Frame& frame) {
  std::vector<std::uint8_t> buffer(frame.header.size_bytes() + frame.packets.size() +
                                   frame.last_messages.size());
  FrameWriter writer(buffer, frame.header, buffer.size());
  std::span<const std::uint8_t> packet;
  for (PacketReader reader(frame.packets); reader.next(packet);) writer.append(packet);
  LastMessage last;
  for (LastMessageReader reader(frame.last_messages); reader.next(last);) writer.append_last(last);
  buffer.resize(writer.finish().size());
  return buffer;
}

}  // namespace swarmtalk::frame
