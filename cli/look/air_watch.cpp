#include "cli/look/air_watch.hpp"

#include "cli/common/commands.hpp"

namespace swarmtalk::cli {

Status AirWatch::open() {
  is_open_ = false;
  daemon_.emplace();
  if (const Status status = daemon_->open(socket_path_); !status) return status;
  ipc::Envelope question;
  question.mutable_capture();
  if (const Status status = daemon_->request(question, envelope_); !status) return status;
  is_open_ = true;
  return Status();
}

Status AirWatch::look() {
  constexpr int kMaxFrames = 1000;  // at once; the screen is to move meanwhile
  for (int i = 0; is_open_ && i < kMaxFrames && caught_signal() == 0; ++i) {
    envelope_.Clear();
    const Status status = daemon_->next(envelope_, std::chrono::milliseconds(0));
    if (status.code() == StatusCode::kTimeout) return Status();
    if (!status) {
      is_open_ = false;
      return status;
    }
    if (envelope_.has_captured()) take(envelope_.captured());
  }
  return Status();
}

void AirWatch::take(const ipc::Captured& captured) {
  ++frames_;
  missed_ += captured.missed();
  const std::string& bytes = captured.frame();
  frame::Frame frame;
  const auto result =
      frame::parse({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, frame);
  if (result == frame::ParseResult::kSealed) ++sealed_;
  if (result == frame::ParseResult::kOk) take(frame, captured.sent());
}

void AirWatch::take(const frame::Frame& frame, bool is_own) {
  frame::PacketReader reader(frame.packets);
  std::span<const std::uint8_t> bytes;
  while (reader.next(bytes)) {
    const auto packet = decode_packet(frame.header.profile, bytes);
    if (!packet) continue;
    AirChannel& channel = channels_[packet->channel];
    channel.is_timestamped = packet->is_timestamped;
    const bool is_direct = packet->node == frame.header.node;
    if (!is_direct) ++channel.forwarded;
    AirPublisher* from = publisher(channel, packet->node);
    if (from == nullptr) continue;
    // A copy counts only where the sender itself is not heard, and each message once.
    if (!is_direct && (from->is_heard || from->newest == packet->message)) {
      if (!from->is_heard)
        from->bytes += packet->sequence == from->sequence ? 0 : packet->size_bytes;
      from->sequence = packet->sequence;
      continue;
    }
    from->is_heard = from->is_heard || is_direct;
    from->is_own = from->is_own || (is_own && is_direct);  // its echo on a udp link comes as heard
    if (from->messages == 0 || from->newest != packet->message) ++from->messages;
    from->newest = packet->message;
    from->sequence = packet->sequence;
    from->bytes += packet->size_bytes;
    from->last = Clock::now();
  }
}

AirPublisher* AirWatch::publisher(AirChannel& channel, std::uint32_t node) {
  const auto found = channel.publishers.find(node);
  if (found != channel.publishers.end()) return &found->second;
  if (publishers_ == kMaxPublishers) {
    ++unlisted_;
    return nullptr;
  }
  ++publishers_;
  return &channel.publishers[node];
}

}  // namespace swarmtalk::cli
