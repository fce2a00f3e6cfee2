// ClientInput: the bytes that a client sends. They come through its socket, or through a ring in
// memory that it shares with us (ipc/byte_ring.hpp); the socket then carries bells only. Used by
// Session, on the daemon's one thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "daemon/session/client_identity.hpp"
#include "daemon/session/ring_pool.hpp"
#include "ipc/byte_ring.hpp"

namespace swarmtalk::daemon {

class ClientInput {
 public:
  enum class Result {
    kBytes,
    kNothing,  // now
    kEnded,    // for good; end_reason() says why
    kBroken,   // what came through the ring or beside it cannot be; the stream has no rest
  };

  /// @param rings  outlives it, as does `client`
  ClientInput(RingPool& rings, const ClientIdentity& client) : rings_(rings), client_(client) {}

  /// Begins the ring. All that follows comes through it. @return false: there is no memory for it
  bool begin_ring();
  bool has_ring() const { return ring_.has_value(); }
  /// To pass to the client once, with what announces the ring; -1: none.
  int descriptor_to_pass() { return ring_ && !is_passed_ ? ring_->memory().descriptor() : -1; }
  void descriptor_is_passed() { is_passed_ = true; }
  /// It could not be passed: all comes through the socket as before.
  void withdraw_ring() { end_ring(true); }

  /// The socket has become readable. While the ring has something, bells of a client that rings
  /// often stay there unread, but not more than a client may have out without being held up.
  /// @param must_hear  read it in any case: it may have come to its end. @return kNothing, kBroken
  Result wake(int socket, bool must_hear);
  /// One frame of what was read. There are not many more bells than frames.
  void note_frame() { ++frames_since_bell_; }
  /// Whether something was left there. It may hide descriptors, which are not to stay for long.
  bool has_unheard() const { return has_unheard_; }
  /// Whether it is for that that something was kBroken.
  bool has_bad_bell() const { return has_bad_bell_; }

  /// @param got  bytes taken, at most the room's, when kBytes
  Result read(int socket, std::span<std::uint8_t> room, std::size_t& got);

  /// Before waiting for the socket. @return false: there is more to read, or the end
  bool sleep(int socket);

  /// Whether the client has to be told that its ring has room; once each time.
  bool take_waiting_writer() { return ring_ && ring_->take_waiting_writer(); }

  const std::string& end_reason() const { return end_reason_; }

  /// Nothing more is read.
  void leave();

 private:
  void end_ring(bool has_left);
  Result hear(int socket, bool to_its_end);
  Result read_socket(int socket, std::span<std::uint8_t> room, std::size_t& got);

  RingPool& rings_;
  const ClientIdentity& client_;
  std::optional<ipc::RingReader> ring_;
  bool is_passed_ = false;
  bool has_unheard_ = false;   // bells in the socket
  bool has_bad_bell_ = false;  // something else came through it
  std::chrono::steady_clock::time_point woken_at_{};
  std::size_t frames_since_bell_ = 0;  // out of the ring, since bells were read
  std::string end_reason_;             // not empty: nothing more comes through the socket
};

}  // namespace swarmtalk::daemon
