#include "drivers/receive_batch.hpp"

#include <algorithm>
#include <cstring>

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;
constexpr std::chrono::seconds kLongestWait = 10s;
constexpr std::size_t kLargestBufferBytes = std::size_t{1} << 30;

}  // namespace

MonotonicTime monotonic_from_stamp(const timespec& stamp, const timespec& real_now,
                                   MonotonicTime monotonic_now) {
  const std::chrono::nanoseconds waited =
      std::chrono::seconds(real_now.tv_sec - stamp.tv_sec) +
      std::chrono::nanoseconds(real_now.tv_nsec - stamp.tv_nsec);
  const bool is_plausible = waited >= 0ns && waited <= kLongestWait;
  return is_plausible ? monotonic_now - waited : monotonic_now;
}

bool enable_receive_stamps(int socket) {
  const int on = 1;
  return setsockopt(socket, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) == 0;
}

void enable_drop_counts(int socket) {
  const int on = 1;  // every Linux since 2.6.33 can
  setsockopt(socket, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
}

void set_receive_buffer(int socket, std::size_t size_bytes) {
  const int size = static_cast<int>(std::min<std::size_t>(size_bytes, kLargestBufferBytes));
  if (setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof size) == 0) return;
  setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &size, sizeof size);
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
  if (count > 0) {
    clock_gettime(CLOCK_REALTIME, &real_now_);
    monotonic_now_ = std::chrono::steady_clock::now();
  }
  return count;
}

Datagram ReceiveBatch::operator[](std::size_t index) const {
  const mmsghdr& message = messages_[index];
  MonotonicTime received_at = monotonic_now_;
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
      received_at = monotonic_from_stamp(stamp, real_now_, monotonic_now_);
    }
  }
  return {{bytes_.data() + index * datagram_bytes_, message.msg_len},
          sources_[index],
          received_at,
          drops};
}

}  // namespace swarmtalk::drivers
