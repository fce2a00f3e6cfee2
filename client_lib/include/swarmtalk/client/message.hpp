// What a subscriber's callback gets: the payload exactly as it was published and what was sensed
// when it arrived. Plain values; a copy may be kept.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include <swarmtalk/client/bytes.hpp>

namespace swarmtalk {

/// Where a robot is, and how long ago that was known.
struct Pose {
  float x_m = 0;
  float y_m = 0;
  float theta_rad = 0;  // counter-clockwise from +x
  std::chrono::milliseconds age{0};
};

/// Messages that did not come, by the place where they were lost.
struct Loss {
  std::uint64_t air = 0;     // gaps in a sender's message numbers that nothing else explains
  std::uint64_t kernel = 0;  // of such gaps: at most what the kernel dropped meanwhile
  std::uint64_t daemon = 0;  // dropped by the daemon: queue full, too old, no memory
  std::uint64_t client = 0;  // dropped in this program, which reads too slowly: queue full, too old
  std::uint64_t late = 0;    // reported as lost on the air or in the kernel before, came after all

  /// All that did not come.
  std::uint64_t total() const { return air + kernel + daemon + client; }
  /// Whether anything is to be told: a loss, or one that came late.
  explicit operator bool() const { return total() + late != 0; }
  Loss& operator+=(const Loss& other) {
    air += other.air;
    kernel += other.kernel;
    daemon += other.daemon;
    client += other.client;
    late += other.late;
    return *this;
  }
  friend bool operator==(const Loss& a, const Loss& b) {
    return a.air == b.air && a.kernel == b.kernel && a.daemon == b.daemon && a.client == b.client &&
           a.late == b.late;
  }
  friend bool operator!=(const Loss& a, const Loss& b) { return !(a == b); }
};

/// Where a message that crossed a gateway was sent first.
struct GatewayOrigin {
  std::string link;                  // its name on the gateway; empty: not known
  std::uint32_t node = 0;            // node id on that link
  std::uint32_t message_number = 0;  // of the message there
};

/// One message, and what was sensed when it arrived.
struct Message {
  /// An unknown distance or bearing is NaN: every comparison with it is false, so a program that
  /// asks `distance_m < 0.5` never takes an unknown distance for a short one.
  static constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

  std::string payload;               // exactly the bytes published, possibly none
  std::uint16_t channel = 0;         // number
  std::uint32_t sender = 0;          // node id of the origin
  std::uint32_t transmitter = 0;     // node id of the robot that it was heard from; equals `sender`
                                     // with 0 hops, and where the packets do not tell
  std::uint32_t epoch = 0;           // tells two runs of one sender apart
  std::uint32_t message_number = 0;  // per sender, channel and epoch
  float distance_m = kUnknown;       // to the last transmitter
  float bearing_rad = kUnknown;     // of it, counter-clockwise from this robot's heading, -pi to pi
  std::optional<Pose> sender_pose;  // of the last transmitter
  static constexpr std::uint32_t kHopsUnknown = 255;  // small profiles do not carry hops
  std::uint32_t hops = 0;                             // 0: heard from the sender itself
  std::uint32_t ttl = 0;                              // hops still allowed
  /// Timestamped channels only: from send() in the sender's program to this callback, without the
  /// time on the air.
  std::optional<std::chrono::microseconds> buffering_delay;
  std::optional<std::chrono::steady_clock::time_point> received_at;  // by the kernel
  bool local = false;  // published on this robot by another program
  /// Set when the message crossed a gateway. `sender` is then the gateway, on the link it came by.
  std::optional<GatewayOrigin> origin;
  Loss lost_before;  // messages of the channel, since this subscription's message before

  /// Whether the distance is known.
  bool has_distance() const { return !std::isnan(distance_m); }
  /// Whether the bearing is known.
  bool has_bearing() const { return !std::isnan(bearing_rad); }

  /// The payload as text.
  std::string_view text() const { return payload; }

  /// The payload as bytes.
  Bytes bytes() const {
    return {reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size()};
  }

  /// The payload as a T that the sender gave to Publisher::send(). Both robots must have the same
  /// struct and byte order.
  /// @return nullopt when the payload is not exactly sizeof(T) bytes: never padded, never cut
  template <typename T>
  std::optional<T> as() const {
    static_assert(std::is_trivially_copyable_v<T>,
                  "only a struct of plain numbers can be copied from a message");
    static_assert(std::is_default_constructible_v<T>, "T needs a default constructor");
    if (payload.size() != sizeof(T)) return std::nullopt;
    T value;
    std::memcpy(&value, payload.data(), sizeof(T));
    return value;
  }
};

}  // namespace swarmtalk
