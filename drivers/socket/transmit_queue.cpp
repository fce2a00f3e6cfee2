#include "drivers/socket/transmit_queue.hpp"

#include <algorithm>
#include <cerrno>

namespace swarmtalk::drivers {

void TransmitQueue::set_medium_header(std::span<const std::uint8_t> header) {
  medium_header_bytes_ = std::min(header.size(), kHeadroomBytes);
  std::copy_n(header.begin(), medium_header_bytes_, medium_header_.begin());
}

std::span<std::uint8_t> TransmitQueue::slot(std::size_t buffer_bytes) {
  std::vector<std::uint8_t>& bytes = frames_[end_].bytes;
  if (bytes.size() < kHeadroomBytes + buffer_bytes) bytes.resize(kHeadroomBytes + buffer_bytes);
  return {bytes.data() + kHeadroomBytes, buffer_bytes};
}

void TransmitQueue::push(std::size_t frame_bytes, std::size_t packets, MonotonicTime built_at) {
  QueuedFrame& queued = frames_[end_];
  queued.size_bytes = frame_bytes;
  queued.packets = packets;
  queued.built_at = built_at;
  std::uint8_t* const begin = queued.bytes.data() + kHeadroomBytes - medium_header_bytes_;
  std::copy_n(medium_header_.begin(), medium_header_bytes_, begin);
  parts_[end_] = {begin, medium_header_bytes_ + frame_bytes};
  msghdr& header = messages_[end_].msg_hdr;
  header = {};
  header.msg_iov = &parts_[end_];
  header.msg_iovlen = 1;
  if (destination_.sin_family != 0) {
    header.msg_name = &destination_;
    header.msg_namelen = sizeof destination_;
  }
  ++end_;
}

/// @return frames taken; -1: errno says why not even one
int TransmitQueue::send_some(int socket) {
  if (end_ - first_ > 1) {
    return sendmmsg(socket, messages_.data() + first_, static_cast<unsigned>(end_ - first_),
                    MSG_DONTWAIT);
  }
  return sendmsg(socket, &messages_[first_].msg_hdr, MSG_DONTWAIT) < 0 ? -1 : 1;
}

int TransmitQueue::send(int socket, LinkCounters& counters) {
  while (!is_empty()) {
    const int sent = send_some(socket);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return errno;
    for (int i = 0; i < sent; ++i) {
      const QueuedFrame& frame = frames_[first_];
      ++counters.frames_sent;
      counters.packets_sent += frame.packets;
      counters.bytes_sent += frame.size_bytes;
      drop_first();
    }
  }
  return 0;
}

void TransmitQueue::drop_first() {
  ++first_;
  if (first_ == end_) first_ = end_ = 0;
}

std::size_t TransmitQueue::drop_built_before(MonotonicTime oldest) {
  std::size_t dropped = 0;
  for (; !is_empty() && frames_[first_].built_at < oldest; ++dropped) drop_first();
  return dropped;
}

}  // namespace swarmtalk::drivers
