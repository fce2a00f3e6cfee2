// Publish, Deliver and Sent, the frames that each message costs, written (the first two also read)
// without an Envelope: the same bytes as protobuf's at a fifth of the work. Whatever is not such a
// frame in its usual form is left to protobuf, which decides what it means. Used by daemon and
// client_lib.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "ipc/ipc.pb.h"

namespace swarmtalk::ipc {

/// The fields of a Publish. What it refers to must outlive it.
struct PublishFrame {
  std::uint32_t publisher_id = 0;
  std::uint64_t publish_number = 0;
  std::string_view payload;
  std::optional<std::uint32_t> ttl;
  std::optional<std::uint64_t> sent_at_ns;
};

/// The fields of a Sent.
struct SentFrame {
  std::uint32_t publisher_id = 0;
  std::uint64_t publish_number = 0;
};

/// Parts of a Deliver.
struct DeliverPose {
  float x_m = 0;
  float y_m = 0;
  float theta_rad = 0;
  std::uint32_t age_ms = 0;
};

struct DeliverLost {
  std::uint32_t air = 0;
  std::uint32_t kernel = 0;
  std::uint32_t daemon = 0;
  std::uint32_t late = 0;
  bool operator==(const DeliverLost&) const = default;
};

struct DeliverOrigin {
  std::string_view link;  // empty: nothing of the origin is known
  std::uint32_t node = 0;
  std::uint32_t message_number = 0;
};

/// The fields of a Deliver. What it refers to must outlive it.
struct DeliverFrame {
  std::uint32_t subscription_id = 0;
  std::string_view payload;
  std::uint32_t channel = 0;
  std::uint32_t sender = 0;
  std::uint32_t message_number = 0;
  std::optional<float> distance_m;
  std::optional<float> bearing_rad;
  std::optional<DeliverPose> sender_pose;  // none also when x, y or theta is missing
  std::uint32_t hops = 0;
  std::uint32_t ttl = 0;
  std::uint32_t transmitter = 0;  // 0: the sender itself, or not known
  std::optional<std::uint64_t> buffering_delay_us;
  std::optional<std::uint64_t> received_at_ns;
  bool local = false;
  std::uint32_t epoch = 0;
  DeliverLost lost_before;
  std::optional<DeliverOrigin> origin;
};

/// Appends the frame with its length to `buffer`, byte for byte as append_frame() of an Envelope.
/// @return false, and `buffer` unchanged, when it is longer than kMaxEnvelopeBytes
bool append_frame(const PublishFrame& frame, std::string& buffer);
bool append_frame(const DeliverFrame& frame, std::string& buffer);
bool append_frame(const SentFrame& frame, std::string& buffer);

/// Reads the bytes of an Envelope that holds this submessage and nothing else.
/// @param frame  as constructed; refers to `envelope` afterwards
/// @return false: anything else, perhaps malformed; `frame` is then of no use
bool parse(std::string_view envelope, PublishFrame& frame);
bool parse(std::string_view envelope, DeliverFrame& frame);

/// The same of what protobuf has read.
PublishFrame frame_of(const Publish& publish);
DeliverFrame frame_of(const Deliver& deliver);

}  // namespace swarmtalk::ipc
