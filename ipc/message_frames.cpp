#include "ipc/message_frames.hpp"

#include <bit>
#include <cstring>

#include "ipc/framing.hpp"

namespace swarmtalk::ipc {
namespace {

static_assert(std::endian::native == std::endian::little, "protobuf's fixed32 is copied");

// Kinds of fields: https://protobuf.dev/programming-guides/encoding
enum class Kind : std::uint32_t { kVarint = 0, kBytes = 2, kFixed32 = 5 };

constexpr std::uint32_t tag(std::uint32_t field, Kind kind) {
  return field << 3 | static_cast<std::uint32_t>(kind);
}

std::size_t varint_bytes(std::uint64_t value) {
  return (static_cast<std::size_t>(std::bit_width(value | 1)) * 9 + 64) / 64;
}

/// Counts the bytes of fields.
class Measure {
 public:
  std::size_t size_bytes() const { return size_bytes_; }
  void varint(std::uint64_t value) { size_bytes_ += varint_bytes(value); }
  void raw(const void*, std::size_t size_bytes) { size_bytes_ += size_bytes; }

 private:
  std::size_t size_bytes_ = 0;
};

/// Writes fields where a Measure has said how much room they take.
class Writer {
 public:
  explicit Writer(char* at) : at_(at) {}
  void varint(std::uint64_t value) {
    char* at = at_;  // in a register: what is written might be at_ itself
    for (; value >= 0x80; value >>= 7) *at++ = static_cast<char>(value | 0x80);
    *at++ = static_cast<char>(value);
    at_ = at;
  }
  void raw(const void* bytes, std::size_t size_bytes) {
    std::memcpy(at_, bytes, size_bytes);
    at_ += size_bytes;
  }

 private:
  char* at_;
};

// Each put() gives its fields to a Measure or a Writer.

template <class To>
void put(std::uint32_t field, std::uint64_t value, To& to) {
  to.varint(tag(field, Kind::kVarint));
  to.varint(value);
}
template <class To>
void put_unless_0(std::uint32_t field, std::uint64_t value, To& to) {
  if (value != 0) put(field, value, to);
}
template <class Number, class To>
void put_if_set(std::uint32_t field, const std::optional<Number>& value, To& to) {
  if (value) put(field, *value, to);
}
template <class To>
void put_real(std::uint32_t field, float value, To& to) {
  to.varint(tag(field, Kind::kFixed32));
  to.raw(&value, sizeof value);
}
template <class To>
void put_real_if_set(std::uint32_t field, const std::optional<float>& value, To& to) {
  if (value) put_real(field, *value, to);
}
template <class To>
void put_bytes(std::uint32_t field, std::string_view bytes, To& to) {
  to.varint(tag(field, Kind::kBytes));
  to.varint(bytes.size());
  to.raw(bytes.data(), bytes.size());
}

template <class To>
void put(const DeliverPose& pose, To& to) {
  put_real(Pose::kXMFieldNumber, pose.x_m, to);
  put_real(Pose::kYMFieldNumber, pose.y_m, to);
  put_real(Pose::kThetaRadFieldNumber, pose.theta_rad, to);
  put(Pose::kAgeMsFieldNumber, pose.age_ms, to);
}

template <class To>
void put(const DeliverLost& lost, To& to) {
  put_unless_0(LostBefore::kAirFieldNumber, lost.air, to);
  put_unless_0(LostBefore::kKernelFieldNumber, lost.kernel, to);
  put_unless_0(LostBefore::kDaemonFieldNumber, lost.daemon, to);
  put_unless_0(LostBefore::kLateFieldNumber, lost.late, to);
}

template <class To>
void put(const DeliverOrigin& origin, To& to) {
  if (origin.link.empty()) return;
  put_bytes(GatewayOrigin::kLinkFieldNumber, origin.link, to);
  put(GatewayOrigin::kNodeFieldNumber, origin.node, to);
  put(GatewayOrigin::kMessageNumberFieldNumber, origin.message_number, to);
}

template <class Message>
std::size_t size_bytes_of(const Message& message) {
  Measure measure;
  put(message, measure);
  return measure.size_bytes();
}

template <class Message, class To>
void put_message(std::uint32_t field, const Message& message, To& to) {
  to.varint(tag(field, Kind::kBytes));
  to.varint(size_bytes_of(message));
  put(message, to);
}

template <class To>
void put(const PublishFrame& frame, To& to) {
  put_unless_0(Publish::kPublisherIdFieldNumber, frame.publisher_id, to);
  put_unless_0(Publish::kPublishNumberFieldNumber, frame.publish_number, to);
  if (!frame.payload.empty()) put_bytes(Publish::kPayloadFieldNumber, frame.payload, to);
  put_if_set(Publish::kTtlFieldNumber, frame.ttl, to);
  put_if_set(Publish::kSentAtNsFieldNumber, frame.sent_at_ns, to);
}

template <class To>
void put(const DeliverFrame& frame, To& to) {
  put_unless_0(Deliver::kSubscriptionIdFieldNumber, frame.subscription_id, to);
  if (!frame.payload.empty()) put_bytes(Deliver::kPayloadFieldNumber, frame.payload, to);
  put_unless_0(Deliver::kChannelFieldNumber, frame.channel, to);
  put_unless_0(Deliver::kSenderFieldNumber, frame.sender, to);
  put_unless_0(Deliver::kMessageNumberFieldNumber, frame.message_number, to);
  put_real_if_set(Deliver::kDistanceMFieldNumber, frame.distance_m, to);
  put_real_if_set(Deliver::kBearingRadFieldNumber, frame.bearing_rad, to);
  if (frame.sender_pose) put_message(Deliver::kSenderPoseFieldNumber, *frame.sender_pose, to);
  put_unless_0(Deliver::kHopsFieldNumber, frame.hops, to);
  put_unless_0(Deliver::kTtlFieldNumber, frame.ttl, to);
  put_if_set(Deliver::kBufferingDelayUsFieldNumber, frame.buffering_delay_us, to);
  put_if_set(Deliver::kReceivedAtNsFieldNumber, frame.received_at_ns, to);
  if (frame.local) put(Deliver::kLocalFieldNumber, 1, to);
  put_unless_0(Deliver::kEpochFieldNumber, frame.epoch, to);
  if (frame.lost_before != DeliverLost{}) {
    put_message(Deliver::kLostBeforeFieldNumber, frame.lost_before, to);
  }
  put_unless_0(Deliver::kTransmitterFieldNumber, frame.transmitter, to);
  if (frame.origin) put_message(Deliver::kOriginFieldNumber, *frame.origin, to);
}

template <class To>
void put(const SentFrame& frame, To& to) {
  put_unless_0(Sent::kPublisherIdFieldNumber, frame.publisher_id, to);
  put_unless_0(Sent::kPublishNumberFieldNumber, frame.publish_number, to);
}

template <class Frame>
bool append(std::uint32_t body_field, const Frame& frame, std::string& buffer) {
  const std::size_t body_bytes = size_bytes_of(frame);
  const std::size_t envelope_bytes =
      varint_bytes(tag(body_field, Kind::kBytes)) + varint_bytes(body_bytes) + body_bytes;
  if (envelope_bytes > kMaxEnvelopeBytes) return false;
  const std::size_t start = buffer.size();
  buffer.resize(start + kLengthBytes + envelope_bytes);
  Writer writer(buffer.data() + start);
  const auto length = static_cast<std::uint32_t>(envelope_bytes);
  writer.raw(&length, kLengthBytes);
  writer.varint(tag(body_field, Kind::kBytes));
  writer.varint(body_bytes);
  put(frame, writer);
  return true;
}

/// Takes fields off the front of bytes. After something that is malformed, or has a form that
/// protobuf would not write, it is at the end and no longer sound.
class Reader {
 public:
  explicit Reader(std::string_view bytes)
      : at_(reinterpret_cast<const std::uint8_t*>(bytes.data())), end_(at_ + bytes.size()) {}

  bool is_at_end() const { return at_ == end_; }
  bool is_sound() const { return is_sound_; }

  std::uint64_t number64() {
    if (at_ != end_ && *at_ < 0x80) return *at_++;
    return long_number();
  }
  std::uint32_t number32() {
    const std::uint64_t value = number64();
    return value <= UINT32_MAX ? static_cast<std::uint32_t>(value) : fail();
  }
  std::uint32_t tag() { return number32(); }
  float real() {
    float value = 0;
    if (left_bytes() < sizeof value) return static_cast<float>(fail());
    std::memcpy(&value, at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::string_view bytes() {
    const std::uint64_t size = number64();
    if (size > left_bytes()) fail();
    if (!is_sound_) return {};
    const char* const begin = reinterpret_cast<const char*>(at_);
    at_ += size;
    return {begin, static_cast<std::size_t>(size)};
  }
  std::uint32_t fail() {
    at_ = end_;
    is_sound_ = false;
    return 0;
  }

 private:
  std::size_t left_bytes() const { return static_cast<std::size_t>(end_ - at_); }

  // More than one byte, or none.
  std::uint64_t long_number() {
    std::uint64_t value = 0;
    unsigned shift = 0;
    for (const std::uint8_t* at = at_; at != end_ && shift < 63; shift += 7) {
      const std::uint8_t byte = *at++;
      value |= std::uint64_t{byte & 0x7Fu} << shift;
      if (byte >= 0x80) continue;
      if (byte == 0) break;  // longer than need be
      at_ = at;
      return value;
    }
    return fail();
  }

  const std::uint8_t* at_;
  const std::uint8_t* end_;
  bool is_sound_ = true;
};

/// The one submessage of an Envelope. @return none: something else is in it
std::optional<std::string_view> only_body(std::string_view envelope, std::uint32_t field) {
  Reader reader(envelope);
  if (reader.tag() != tag(field, Kind::kBytes)) return std::nullopt;
  const std::string_view body = reader.bytes();
  if (!reader.is_sound() || !reader.is_at_end()) return std::nullopt;
  return body;
}

void read_pose(Reader& from, std::optional<DeliverPose>& to) {
  if (to) return static_cast<void>(from.fail());  // protobuf merges the two
  Reader reader(from.bytes());
  bool has_x = false;
  bool has_y = false;
  bool has_theta = false;
  DeliverPose pose;
  while (!reader.is_at_end()) {
    switch (reader.tag()) {
      case tag(Pose::kXMFieldNumber, Kind::kFixed32):
        pose.x_m = reader.real();
        has_x = true;
        break;
      case tag(Pose::kYMFieldNumber, Kind::kFixed32):
        pose.y_m = reader.real();
        has_y = true;
        break;
      case tag(Pose::kThetaRadFieldNumber, Kind::kFixed32):
        pose.theta_rad = reader.real();
        has_theta = true;
        break;
      case tag(Pose::kAgeMsFieldNumber, Kind::kVarint):
        pose.age_ms = reader.number32();
        break;
      default:
        reader.fail();
    }
  }
  if (!reader.is_sound() || !has_x || !has_y || !has_theta) from.fail();
  to = pose;
}

bool read_field(std::uint32_t field, Reader& from, PublishFrame& to) {
  switch (field) {
    case tag(Publish::kPublisherIdFieldNumber, Kind::kVarint):
      to.publisher_id = from.number32();
      return true;
    case tag(Publish::kPublishNumberFieldNumber, Kind::kVarint):
      to.publish_number = from.number64();
      return true;
    case tag(Publish::kPayloadFieldNumber, Kind::kBytes):
      to.payload = from.bytes();
      return true;
    case tag(Publish::kTtlFieldNumber, Kind::kVarint):
      to.ttl = from.number32();
      return true;
    case tag(Publish::kSentAtNsFieldNumber, Kind::kVarint):
      to.sent_at_ns = from.number64();
      return true;
    default:
      return false;
  }
}

// Losses and gateways are rare enough to be left to protobuf.
bool read_field(std::uint32_t field, Reader& from, DeliverFrame& to) {
  switch (field) {
    case tag(Deliver::kSubscriptionIdFieldNumber, Kind::kVarint):
      to.subscription_id = from.number32();
      return true;
    case tag(Deliver::kPayloadFieldNumber, Kind::kBytes):
      to.payload = from.bytes();
      return true;
    case tag(Deliver::kChannelFieldNumber, Kind::kVarint):
      to.channel = from.number32();
      return true;
    case tag(Deliver::kSenderFieldNumber, Kind::kVarint):
      to.sender = from.number32();
      return true;
    case tag(Deliver::kMessageNumberFieldNumber, Kind::kVarint):
      to.message_number = from.number32();
      return true;
    case tag(Deliver::kDistanceMFieldNumber, Kind::kFixed32):
      to.distance_m = from.real();
      return true;
    case tag(Deliver::kBearingRadFieldNumber, Kind::kFixed32):
      to.bearing_rad = from.real();
      return true;
    case tag(Deliver::kSenderPoseFieldNumber, Kind::kBytes):
      read_pose(from, to.sender_pose);
      return true;
    case tag(Deliver::kHopsFieldNumber, Kind::kVarint):
      to.hops = from.number32();
      return true;
    case tag(Deliver::kTtlFieldNumber, Kind::kVarint):
      to.ttl = from.number32();
      return true;
    case tag(Deliver::kBufferingDelayUsFieldNumber, Kind::kVarint):
      to.buffering_delay_us = from.number64();
      return true;
    case tag(Deliver::kReceivedAtNsFieldNumber, Kind::kVarint):
      to.received_at_ns = from.number64();
      return true;
    case tag(Deliver::kLocalFieldNumber, Kind::kVarint):
      to.local = from.number64() != 0;
      return true;
    case tag(Deliver::kEpochFieldNumber, Kind::kVarint):
      to.epoch = from.number32();
      return true;
    case tag(Deliver::kTransmitterFieldNumber, Kind::kVarint):
      to.transmitter = from.number32();
      return true;
    default:
      return false;
  }
}

template <typename Frame>
bool parse_body(std::string_view envelope, std::uint32_t body_field, Frame& frame) {
  const auto body = only_body(envelope, body_field);
  if (!body) return false;
  Reader reader(*body);
  while (!reader.is_at_end()) {
    if (!read_field(reader.tag(), reader, frame)) return false;
  }
  return reader.is_sound();
}

}  // namespace

bool append_frame(const PublishFrame& frame, std::string& buffer) {
  return append(Envelope::kPublishFieldNumber, frame, buffer);
}

bool append_frame(const DeliverFrame& frame, std::string& buffer) {
  return append(Envelope::kDeliverFieldNumber, frame, buffer);
}

bool append_frame(const SentFrame& frame, std::string& buffer) {
  return append(Envelope::kSentFieldNumber, frame, buffer);
}

bool parse(std::string_view envelope, PublishFrame& frame) {
  return parse_body(envelope, Envelope::kPublishFieldNumber, frame);
}

bool parse(std::string_view envelope, DeliverFrame& frame) {
  return parse_body(envelope, Envelope::kDeliverFieldNumber, frame);
}

PublishFrame frame_of(const Publish& publish) {
  PublishFrame frame;
  frame.publisher_id = publish.publisher_id();
  frame.publish_number = publish.publish_number();
  frame.payload = publish.payload();
  if (publish.has_ttl()) frame.ttl = publish.ttl();
  if (publish.has_sent_at_ns()) frame.sent_at_ns = publish.sent_at_ns();
  return frame;
}

DeliverFrame frame_of(const Deliver& deliver) {
  DeliverFrame frame;
  frame.subscription_id = deliver.subscription_id();
  frame.payload = deliver.payload();
  frame.channel = deliver.channel();
  frame.sender = deliver.sender();
  frame.message_number = deliver.message_number();
  if (deliver.has_distance_m()) frame.distance_m = deliver.distance_m();
  if (deliver.has_bearing_rad()) frame.bearing_rad = deliver.bearing_rad();
  const Pose& pose = deliver.sender_pose();
  if (pose.has_x_m() && pose.has_y_m() && pose.has_theta_rad()) {
    frame.sender_pose = {pose.x_m(), pose.y_m(), pose.theta_rad(), pose.age_ms()};
  }
  frame.hops = deliver.hops();
  frame.transmitter = deliver.transmitter();
  frame.ttl = deliver.ttl();
  if (deliver.has_buffering_delay_us()) frame.buffering_delay_us = deliver.buffering_delay_us();
  if (deliver.has_received_at_ns()) frame.received_at_ns = deliver.received_at_ns();
  frame.local = deliver.local();
  frame.epoch = deliver.epoch();
  const LostBefore& lost = deliver.lost_before();
  frame.lost_before = {lost.air(), lost.kernel(), lost.daemon(), lost.late()};
  const GatewayOrigin& origin = deliver.origin();
  if (deliver.has_origin()) frame.origin = {origin.link(), origin.node(), origin.message_number()};
  return frame;
}

}  // namespace swarmtalk::ipc
