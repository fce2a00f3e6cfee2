#include "ipc/framing.hpp"

#include <cstring>

namespace swarmtalk::ipc {
namespace {

std::uint32_t read_length(const char* bytes) {
  std::uint32_t length = 0;
  for (std::size_t i = 0; i < kLengthBytes; ++i) {
    length |= static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes[i])) << (8 * i);
  }
  return length;
}

void write_length(std::uint32_t length, char* bytes) {
  for (std::size_t i = 0; i < kLengthBytes; ++i) {
    bytes[i] = static_cast<char>(static_cast<std::uint8_t>(length >> (8 * i)));
  }
}

thread_local bool inside_protobuf = false;

class InsideProtobuf {
 public:
  InsideProtobuf() { inside_protobuf = true; }
  ~InsideProtobuf() { inside_protobuf = false; }
  InsideProtobuf(const InsideProtobuf&) = delete;
  InsideProtobuf& operator=(const InsideProtobuf&) = delete;
};

}  // namespace

std::span<std::uint8_t> FrameReader::prepare(std::size_t at_least) {
  if (begin_ == end_) begin_ = end_ = 0;
  if (buffer_.size() - end_ < at_least && begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  if (buffer_.size() - end_ < at_least) buffer_.resize(end_ + at_least);
  auto* room = reinterpret_cast<std::uint8_t*>(buffer_.data()) + end_;
  return {room, buffer_.size() - end_};
}

void FrameReader::commit(std::size_t size_bytes) {
  end_ += size_bytes;
}

ReadResult FrameReader::next(std::string_view& envelope) {
  if (end_ - begin_ < kLengthBytes) return ReadResult::kNeedMore;
  const std::size_t length = read_length(buffer_.data() + begin_);
  if (length == 0 || length > kMaxEnvelopeBytes) return ReadResult::kMalformed;
  if (end_ - begin_ - kLengthBytes < length) return ReadResult::kNeedMore;
  envelope = {buffer_.data() + begin_ + kLengthBytes, length};
  begin_ += kLengthBytes + length;
  return ReadResult::kEnvelope;
}

ReadResult FrameReader::next(Envelope& envelope) {
  std::string_view bytes;
  const ReadResult result = next(bytes);
  if (result != ReadResult::kEnvelope) return result;
  return parse(bytes, envelope) ? ReadResult::kEnvelope : ReadResult::kMalformed;
}

void FrameReader::clear() {
  begin_ = end_ = 0;
}

bool is_inside_protobuf() {
  return inside_protobuf;
}

bool parse(std::string_view bytes, Envelope& envelope) {
  const InsideProtobuf inside;
  return envelope.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

bool append_frame(const Envelope& envelope, std::string& buffer) {
  const InsideProtobuf inside;
  const std::size_t length = envelope.ByteSizeLong();
  if (length == 0 || length > kMaxEnvelopeBytes) return false;
  const std::size_t start = buffer.size();
  buffer.resize(start + kLengthBytes + length);
  write_length(static_cast<std::uint32_t>(length), buffer.data() + start);
  envelope.SerializeWithCachedSizesToArray(
      reinterpret_cast<std::uint8_t*>(buffer.data() + start + kLengthBytes));
  return true;
}

std::size_t frame_bytes(const char* buffer) {
  return kLengthBytes + read_length(buffer);
}

int count_bodies(const Envelope& envelope) {
  return int{envelope.has_hello()} + envelope.has_failure() + envelope.has_done() +
         envelope.has_subscribe() + envelope.has_subscribed() + envelope.has_unsubscribe() +
         envelope.has_advertise() + envelope.has_advertised() + envelope.has_unadvertise() +
         envelope.has_publish() + envelope.has_sent() + envelope.has_deliver() +
         envelope.has_get_status() + envelope.has_status() + envelope.has_set_pose() +
         envelope.has_get_pose() + envelope.has_pose() + envelope.has_client_loss() +
         envelope.has_get_neighbours() + envelope.has_neighbours() +
         envelope.has_kilobot_command() + envelope.has_kilobot_started() +
         envelope.has_kilobot_progress() + envelope.has_kilobot_ended() +
         envelope.has_kilobot_cancel() + envelope.has_reload() + envelope.has_reloaded() +
         envelope.has_set_log_level() + envelope.has_log_levels() + envelope.has_set_node_id() +
         envelope.has_get_metrics() + envelope.has_metrics() + envelope.has_capture() +
         envelope.has_captured() + envelope.has_check_configuration();
}

}  // namespace swarmtalk::ipc
