// The air frame of the raw layer-2 and UDP links (docs/wire-format.md): what a transmitter puts
// around its packets. FrameWriter builds one in the caller's buffer, parse() reads one. A leaf:
// no I/O, no allocation, no clock. Nothing here reads or writes outside the spans it is given.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace swarmtalk::frame {

inline constexpr std::uint16_t kDefaultEthertype = 0x88B5;  // IEEE 802 Local Experimental 1
inline constexpr std::uint8_t kVersion = 1;
inline constexpr std::size_t kHeaderBytes = 18;
inline constexpr std::size_t kPoseBytes = 7;
inline constexpr std::size_t kLastMessageBytes = 6;   // of a beacon: a channel and a number
inline constexpr std::size_t kLengthPrefixBytes = 2;  // in front of each packet
// Of a sealed frame (sealing.hpp).
inline constexpr std::size_t kKeyIdBytes = 2;
inline constexpr std::size_t kSessionBytes = 6;
inline constexpr std::size_t kTagBytes = 16;
inline constexpr std::size_t kSealedHeaderBytes = kHeaderBytes + kKeyIdBytes + kSessionBytes;
inline constexpr std::size_t kSealBytes = kKeyIdBytes + kSessionBytes + kTagBytes;
inline constexpr std::size_t kFreshBytes = 10;  // and more (freshness.hpp), inside of a fresh one
// Offsets that the nonce is made of, in bytes from the magic.
inline constexpr std::size_t kNodeAt = 8;
inline constexpr std::size_t kEpochAt = 10;
inline constexpr std::size_t kCounterAt = 14;
inline constexpr std::size_t kKeyIdAt = kHeaderBytes;
inline constexpr std::size_t kSessionAt = kKeyIdAt + kKeyIdBytes;
inline constexpr std::size_t kMaxFrameBytes = 65535;  // what the length field can say

/// Wire format of the packets in a frame; the numbers are on the air.
enum class ProfileId : std::uint8_t { kWifi = 0, kKilobot = 1, kClassic2020 = 2, kFootbot = 3 };

/// Where the transmitter was when the frame left, in the units of the wire.
struct FramePose {
  static constexpr std::uint8_t kOldest = 254;  // "2540 ms or more"
  static constexpr std::uint8_t kStale = 255;   // x, y and theta mean nothing
  static constexpr std::int16_t kMaxMm = 32767;

  std::int16_t x_mm = 0;
  std::int16_t y_mm = 0;
  std::uint16_t theta_turns16 = 0;  // 1/65536 of a turn, counter-clockwise from +x
  std::uint8_t age_10ms = kStale;   // steps of 10 ms

  /// Rounds to the nearest step. A coordinate that is not finite or beyond +-32.767 m, or an angle
  /// that is not finite, gives a stale pose: a clipped position would be a wrong one.
  /// @param theta_rad  any angle, taken modulo a turn
  /// @param age_s      below 0 counts as 0, 2.54 s and more as kOldest, not finite as stale
  static FramePose from_metres(double x_m, double y_m, double theta_rad, double age_s);
  static FramePose stale() { return FramePose{}; }

  bool is_stale() const { return age_10ms == kStale; }
  double x_m() const { return x_mm / 1000.0; }
  double y_m() const { return y_mm / 1000.0; }
  double theta_rad() const;                          // (-pi, pi]
  double age_s() const { return age_10ms / 100.0; }  // at least this, when kOldest

  bool operator==(const FramePose&) const = default;
};

struct FrameHeader {
  ProfileId profile = ProfileId::kWifi;
  std::uint16_t node = 0;         // node id of the transmitter, not of a message's origin
  std::uint32_t epoch = 0;        // random, drawn when the transmitter's daemon started
  std::uint32_t counter = 0;      // frames sent in this epoch, from 1
  std::optional<FramePose> pose;  // none: the robot has no pose
  bool is_beacon = false;         // last messages follow, in place of packets
  bool is_ghost = false;          // of a simulated robot on the air of real ones

  std::size_t size_bytes() const { return kHeaderBytes + (pose ? kPoseBytes : 0); }
  bool operator==(const FrameHeader&) const = default;
};

/// What a beacon says of a channel: the number of the last message whose packets have all left.
struct LastMessage {
  std::uint16_t channel = 0;
  std::uint32_t number = 0;
  bool operator==(const LastMessage&) const = default;
};

/// Largest packet that fits into a frame of `frame_bytes` beside a header with a pose, and the seal
/// of a fresh frame if there is one; 0: none.
constexpr std::size_t max_packet_bytes(std::size_t frame_bytes, bool is_sealed = false) {
  constexpr std::size_t kOverheadBytes = kHeaderBytes + kPoseBytes + kLengthPrefixBytes;
  const std::size_t around = kOverheadBytes + (is_sealed ? kSealBytes + kFreshBytes : 0);
  return frame_bytes > around ? frame_bytes - around : 0;
}

class Sealer;

/// Builds one frame in a buffer of the caller. Packets are written in place: take room(), write a
/// packet to its beginning, commit() its size.
///
/// The buffer may be longer than the frame may get. Then room() has space for a packet that turns
/// out not to fit; commit() refuses it and it stays readable at room() until the next commit.
class FrameWriter {
 public:
  /// Writes the header. @param buffer  kept by reference; at least header.size_bytes()
  /// @param limit_bytes  the finished frame's greatest size, cut to the buffer and kMaxFrameBytes
  /// @param sealer  the frame is sealed with it; kept by reference. Null: it is not sealed. With
  ///   one the buffer has at least kSealBytes more
  /// @param fresh  what Freshness has written for this frame, which is copied; it then is a fresh
  ///   one. Empty: it is not. Only with a sealer, and with as much more room in the buffer
  FrameWriter(std::span<std::uint8_t> buffer, const FrameHeader& header, std::size_t limit_bytes,
              const Sealer* sealer = nullptr, std::span<const std::uint8_t> fresh = {});

  /// Where the next packet goes, to the end of the buffer. Empty: not even a length fits.
  std::span<std::uint8_t> room() const;

  /// Bytes of the longest packet that commit() still takes.
  std::size_t left_bytes() const {
    const std::size_t used = size_bytes_ + kLengthPrefixBytes;
    return used < limit_bytes_ ? limit_bytes_ - used : 0;
  }

  /// The first `packet_bytes` of room() are a packet. @return false, and nothing changed: it is
  /// empty, or the frame would exceed its limit.
  bool commit(std::size_t packet_bytes);

  /// Appends a copy of `packet`. @return as commit()
  bool append(std::span<const std::uint8_t> packet);

  /// Of a beacon. @return false: the frame would exceed its limit
  bool append_last(const LastMessage& last);

  std::size_t packets() const { return packets_; }
  std::size_t size_bytes() const { return size_bytes_; }  // without a tag

  /// Writes the length, and seals. Once only. @return the frame
  std::span<const std::uint8_t> finish();

 private:
  std::span<std::uint8_t> buffer_;
  std::size_t limit_bytes_;
  const Sealer* sealer_;
  std::size_t size_bytes_;
  std::size_t packets_ = 0;
};

enum class ParseResult : std::uint8_t {
  kOk,
  kNotOurs,
  kOtherVersion,
  kUnknownFlags,
  kTruncated,
  kSealed,        // and we have no key
  kWithoutKey,    // and we have one
  kOtherKey,      // sealed with another
  kNotFresh,      // sealed without a nonce: it does not tell when
  kReplayed,      // heard before
  kNotProven,     // of a session that has not shown yet that it lives
  kTooOld,        // held back
  kNotAuthentic,  // damaged, or forged
};

/// Name of the counter that such a frame is counted under ("frames_truncated"); kOk: empty.
std::string_view counter_name(ParseResult result);

/// One parsed frame. `packets` and `last_messages` point into the parsed bytes, one of them is
/// empty; read them with a PacketReader, a LastMessageReader.
struct Frame {
  FrameHeader header;
  std::span<const std::uint8_t> packets;
  std::span<const std::uint8_t> last_messages;
  std::size_t size_bytes = 0;  // without padding
};

/// What parse() finds in a sealed frame, for the Opener.
struct SealedFrame {
  std::span<const std::uint8_t> ciphertext;
  std::span<const std::uint8_t> tag;
  bool has_pose = false;
  bool is_fresh = false;  // the plaintext begins with what freshness.hpp reads

  /// @param plaintext  at least kPoseBytes if has_pose; frame.packets will point into it
  void read_plaintext(std::span<const std::uint8_t> plaintext, Frame& frame) const;
};

/// Reads a frame's header. Bytes beyond its length (Ethernet padding) are ignored.
/// @param frame  filled when kOk. header.profile may be a number that ProfileId does not name.
/// @param sealed  filled when kSealed, if not null; then `frame` has all but pose and packets
ParseResult parse(std::span<const std::uint8_t> bytes, Frame& frame, SealedFrame* sealed = nullptr);

/// Walks the packets of a parsed frame.
class PacketReader {
 public:
  explicit PacketReader(std::span<const std::uint8_t> packets) : rest_(packets) {}

  /// @param packet  set to the next packet, 1 to 65535 bytes. @return false: no more
  bool next(std::span<const std::uint8_t>& packet);

  /// The walk ended at a length of 0 or one that reaches past the end (`frames_bad_packet_length`).
  bool is_malformed() const { return is_malformed_; }

 private:
  std::span<const std::uint8_t> rest_;
  bool is_malformed_ = false;
};

/// The frame as a robot without a key would have sent it; what cannot be read of it is left out.
std::vector<std::uint8_t> plain_copy(const Frame& frame);

/// Walks the last messages of a parsed beacon.
class LastMessageReader {
 public:
  explicit LastMessageReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  /// @return false: no more
  bool next(LastMessage& last);

  /// The walk ended at a piece of one (`frames_bad_packet_length`).
  bool is_malformed() const { return !rest_.empty() && rest_.size() < kLastMessageBytes; }

 private:
  std::span<const std::uint8_t> rest_;
};

}  // namespace swarmtalk::frame
