// ReceiveBatch: reads up to 64 datagrams of a socket in one system call, with their sender and the
// kernel's receive time. Used by SocketLink; owns the buffers.
#pragma once

#include <sys/socket.h>
#include <time.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/link/link.hpp"

namespace swarmtalk::drivers {

/// Kernel stamps are wall clock: this takes them to the monotonic clock, as long as nobody sets the
/// wall clock between a stamp and its conversion.
class StampClock {
 public:
  /// Reads both clocks, after datagrams were read.
  void read();
  /// The same with given times. When their difference has changed since the call before, the wall
  /// clock was set, and stamps from before cannot be told from stamps after: none is believed until
  /// the next call.
  void set_now(const timespec& real_now, MonotonicTime monotonic_now);

  /// @return none: the wall clock was set, or the stamp lies in the future or more than 60 s back
  std::optional<MonotonicTime> monotonic(const timespec& stamp) const;

  MonotonicTime now() const { return monotonic_now_; }

 private:
  timespec real_now_{};
  MonotonicTime monotonic_now_{};
  std::optional<std::chrono::nanoseconds> difference_;
  bool is_set_ = false;  // the wall clock, since the call before
};

/// Asks the kernel for receive times. @return false, errno set: it has none
bool enable_receive_stamps(int socket);

/// Asks the kernel to tell with each datagram how many its full buffer has lost before it.
void enable_drop_counts(int socket);

struct Datagram {
  std::span<const std::uint8_t> bytes;
  const sockaddr_storage& source;
  MonotonicTime received_at;  // when it was read, if the kernel's stamp cannot be believed
  bool is_time_known;
  std::uint32_t drops;  // of the socket before this one, wraps; 0 without enable_drop_counts()
};

class ReceiveBatch {
 public:
  static constexpr std::size_t kDatagrams = 64;

  /// Longest datagram that is read whole; the rest of a longer one is cut off. Not between read()
  /// and the use of its datagrams.
  void set_datagram_bytes(std::size_t datagram_bytes);

  /// Reads what waits, without blocking. @return datagrams, 0 to 64; -1: errno says why
  int read(int socket);

  /// @param index  below the last read()'s result. Valid until the next read()
  Datagram operator[](std::size_t index) const;

 private:
  struct alignas(cmsghdr) Control {
    std::array<std::uint8_t, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))>
        bytes;
  };

  void prepare(std::size_t index);

  std::size_t datagram_bytes_ = 0;
  std::size_t used_ = kDatagrams;  // headers to prepare again before the next read
  std::vector<std::uint8_t> bytes_;
  std::array<iovec, kDatagrams> parts_{};
  std::array<mmsghdr, kDatagrams> messages_{};
  std::array<sockaddr_storage, kDatagrams> sources_{};
  std::array<Control, kDatagrams> controls_{};
  StampClock clock_;
};

}  // namespace swarmtalk::drivers
