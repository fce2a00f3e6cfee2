#include "drivers/socket/receive_batch.hpp"

#include <algorithm>
#include <cstring>

#include "loop/clock.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;
constexpr std::chrono::seconds kLongestWait = 60s;           // as long as nonces are remembered
constexpr std::chrono::microseconds kLongestReading = 20us;  // of both clocks
constexpr std::chrono::microseconds kSmallestStep = 500us;   // of the wall clock; NTP slews both

timespec to_timespec(std::chrono::system_clock::time_point time) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  const std::chrono::nanoseconds rest = time - seconds;
  return {static_cast<time_t>(seconds.time_since_epoch().count()), static_cast<long>(rest.count())};
}

}  // namespace

void StampClock::read() {
  std::chrono::system_clock::time_point real;
  MonotonicTime before;
  MonotonicTime after;
  // An interruption between the two clocks would look like an error of its length.
  for (int tries = 0; tries < 3; ++tries) {
    before = loop::now();
    real = loop::wall_now();
    after = loop::now();
    if (after - before < kLongestReading) break;
  }
  set_now(to_timespec(real), before + (after - before) / 2);
}

void StampClock::set_now(const timespec& real_now, MonotonicTime monotonic_now) {
  real_now_ = real_now;
  monotonic_now_ = monotonic_now;
  const std::chrono::nanoseconds difference = std::chrono::seconds(real_now.tv_sec) +
                                              std::chrono::nanoseconds(real_now.tv_nsec) -
                                              monotonic_now.time_since_epoch();
  is_set_ = difference_ && (difference - *difference_ > kSmallestStep ||
                            *difference_ - difference > kSmallestStep);
  difference_ = difference;
}

std::optional<MonotonicTime> StampClock::monotonic(const timespec& stamp) const {
  const std::chrono::nanoseconds waited =
      std::chrono::seconds(real_now_.tv_sec - stamp.tv_sec) +
      std::chrono::nanoseconds(real_now_.tv_nsec - stamp.tv_nsec);
  if (is_set_ || waited < -kLongestReading || waited > kLongestWait) return std::nullopt;
  return monotonic_now_ - std::max(waited, 0ns);
}

bool enable_receive_stamps(int socket) {
  const int on = 1;
  return setsockopt(socket, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) == 0;
}

void enable_drop_counts(int socket) {
  const int on = 1;  // every Linux since 2.6.33 can
  setsockopt(socket, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
}

void ReceiveBatch::set_datagram_bytes(std::size_t datagram_bytes) {
  if (datagram_bytes == datagram_bytes_) return;
  datagram_bytes_ = datagram_bytes;
  bytes_.resize(kDatagrams * datagram_bytes_);
  used_ = kDatagrams;
}

void ReceiveBatch::prepare(std::size_t index) {
  parts_[index] = {bytes_.data() + index * datagram_bytes_, datagram_bytes_};
  msghdr& header = messages_[index].msg_hdr;
  header.msg_name = &sources_[index];
  header.msg_namelen = sizeof sources_[index];
  header.msg_iov = &parts_[index];
  header.msg_iovlen = 1;
  header.msg_control = controls_[index].bytes.data();
  header.msg_controllen = controls_[index].bytes.size();
  header.msg_flags = 0;
}

int ReceiveBatch::read(int socket) {
  for (std::size_t i = 0; i < used_; ++i) prepare(i);
  const int count = recvmmsg(socket, messages_.data(), kDatagrams, MSG_DONTWAIT, nullptr);
  // The kernel writes to those that it fills, and to the one at which an error stops it.
  used_ = std::min<std::size_t>(static_cast<std::size_t>(std::max(count, 0)) + 1, kDatagrams);
  if (count > 0) clock_.read();
  return count;
}

Datagram ReceiveBatch::operator[](std::size_t index) const {
  const mmsghdr& message = messages_[index];
  std::optional<MonotonicTime> received_at = clock_.now();  // without a stamp
  std::uint32_t drops = 0;  // the kernel leaves it out while it is 0
  // CMSG_NXTHDR wants a header it may write to; it only reads.
  msghdr header = message.msg_hdr;
  for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr; part = CMSG_NXTHDR(&header, part)) {
    if (part->cmsg_level != SOL_SOCKET) continue;
    if (part->cmsg_type == SO_RXQ_OVFL) {
      std::memcpy(&drops, CMSG_DATA(part), sizeof drops);
    } else if (part->cmsg_type == SCM_TIMESTAMPNS) {
      timespec stamp;
      std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
      received_at = clock_.monotonic(stamp);
    }
  }
  return {{bytes_.data() + index * datagram_bytes_, message.msg_len},
          sources_[index],
          received_at.value_or(clock_.now()),
          received_at.has_value(),
          drops};
}

}  // namespace swarmtalk::drivers
