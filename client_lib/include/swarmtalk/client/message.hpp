// What a subscriber's callback gets: the payload exactly as it was published and what was sensed
// when it arrived. Plain values; a copy may be kept.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace swarmtalk {

struct Pose {
  float x_m = 0;
  float y_m = 0;
  float theta_rad = 0;  // counter-clockwise from +x
  std::chrono::milliseconds age{0};
};

struct Message {
  /// An unknown distance or bearing is NaN: every comparison with it is false, so a program that
  /// asks `distance_m < 0.5` never takes an unknown distance for a short one.
  static constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

  std::string payload;               // exactly the bytes published, possibly none
  std::uint16_t channel = 0;         // number
  std::uint32_t sender = 0;          // node id of the origin
  std::uint32_t epoch = 0;           // tells two runs of one sender apart
  std::uint32_t message_number = 0;  // per sender, channel and epoch; a gap is a loss
  float distance_m = kUnknown;       // to the last transmitter
  float bearing_rad = kUnknown;     // of it, counter-clockwise from this robot's heading, -pi to pi
  std::optional<Pose> sender_pose;  // of the last transmitter
  std::uint32_t hops = 0;           // 0: heard from the sender itself
  std::uint32_t ttl = 0;            // hops still allowed
  std::optional<std::chrono::microseconds> buffering_delay;          // timestamped channels only
  std::optional<std::chrono::steady_clock::time_point> received_at;  // by the kernel
  bool local = false;                // published on this robot by another program
  std::uint32_t dropped_before = 0;  // messages lost in this subscription's queue just before

  bool has_distance() const { return !std::isnan(distance_m); }
  bool has_bearing() const { return !std::isnan(bearing_rad); }

  std::string_view text() const { return payload; }

  std::span<const std::uint8_t> bytes() const {
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
