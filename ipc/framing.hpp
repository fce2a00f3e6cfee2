// Framing of the local protocol: a u32 little-endian length, then that many bytes of one Envelope.
// FrameReader cuts a byte stream into envelopes, FrameWriter appends envelopes to one buffer. Both
// reuse their memory: in steady state a message costs no allocation. Used by daemon and client_lib.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "ipc/ipc.pb.h"

namespace swarmtalk::ipc {

inline constexpr std::uint32_t kProtocolMajor = 1;
inline constexpr std::uint32_t kProtocolMinor = 2;
inline constexpr std::size_t kLengthBytes = 4;
inline constexpr std::size_t kMaxEnvelopeBytes = 64 * 1024;
inline constexpr const char* kDefaultSocketPath = "/run/swarmtalk/swarmtalkd.sock";
inline constexpr const char* kSocketVariable = "SWARMTALK_SOCKET";

enum class ReadResult { kEnvelope, kNeedMore, kMalformed };

class FrameReader {
 public:
  /// Room to read into: at least `at_least` bytes. Valid until the next call of any method.
  std::span<std::uint8_t> prepare(std::size_t at_least);

  /// `size_bytes` of the room have been filled.
  void commit(std::size_t size_bytes);

  /// Parses the next whole envelope into `envelope` (reused; its old content is cleared).
  /// @return kNeedMore when no whole frame has arrived yet; kMalformed for a length of 0 or over
  ///   kMaxEnvelopeBytes, or bytes that are no Envelope: the stream cannot be resumed after it.
  ReadResult next(Envelope& envelope);

  /// The same without a look inside. @param envelope  its bytes, valid until the next prepare() or
  ///   clear()
  ReadResult next(std::string_view& envelope);

  /// Forgets everything (a new connection).
  void clear();

 private:
  std::string buffer_;
  std::size_t begin_ = 0;  // first unread byte
  std::size_t end_ = 0;    // one past the last filled byte
};

/// Parses the bytes of an Envelope (reused; its old content is cleared). @return false: malformed
bool parse(std::string_view bytes, Envelope& envelope);

/// Whether this thread is in one of the calls here: what protobuf logs meanwhile is of our frames.
/// It does not name them.
bool is_inside_protobuf();

/// Appends `envelope` with its length to `buffer`.
/// @return false, and `buffer` unchanged, when it is longer than kMaxEnvelopeBytes.
bool append_frame(const Envelope& envelope, std::string& buffer);

/// Bytes of the frame at the start of `buffer`, its length included. @pre it is whole
std::size_t frame_bytes(const char* buffer);

/// How many of the Envelope's submessages are set; every legal frame has exactly one.
int count_bodies(const Envelope& envelope);

}  // namespace swarmtalk::ipc
