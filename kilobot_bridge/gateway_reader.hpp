// GatewayReader: the gateway Kilobot's reports out of the bytes of its serial line (KGU1,
// gateway_frame.hpp). Resynchronises by itself, counts what it cannot read and what is missing by
// the sequence numbers. Malformed input never does more than that.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "kilobot_bridge/frame_builder.hpp"
#include "kilobot_wire/gateway_frame.hpp"

namespace swarmtalk::kilobot_bridge {

/// A message that the gateway heard.
struct GatewayReception {
  IrData data{};
  std::uint8_t ir_type = 0;
  std::uint16_t low_gain = 0;  // 10-bit converter readings
  std::uint16_t high_gain = 0;
  std::optional<std::uint8_t> distance_mm;  // centre to centre; none: the gateway cannot tell
};

/// Once a second.
struct GatewayHello {
  std::uint16_t uid = 0;
  std::uint8_t version = 0;
  std::uint16_t battery = 0;  // converter reading
};

/// Our overhead controller's answer when it was asked.
struct ControllerVersion {
  std::uint8_t product = 0;
  std::uint8_t version = 0;
  std::uint16_t frame_types = 0;  // bit n: it knows frames of type n
  std::uint8_t flags = 0;
};

class GatewayUser {
 public:
  virtual ~GatewayUser() = default;
  virtual void on_reception(const GatewayReception& reception) = 0;
  virtual void on_hello(const GatewayHello& hello) = 0;
  virtual void on_version(const ControllerVersion& version) = 0;
  /// Text from the gateway's program; valid during the call, any bytes.
  virtual void on_text(std::string_view text) = 0;
};

class GatewayReader {
 public:
  struct Counters {
    std::uint64_t frames = 0;             // readable ones
    std::uint64_t unreadable_frames = 0;  // wrong length, COBS or checksum
    std::uint64_t missing_frames = 0;     // by sequence numbers: lost on the serial line
    std::uint64_t gateway_drops = 0;      // reports that the gateway had no room for, as it says
    std::uint64_t gateway_restarts = 0;
    std::uint64_t bytes = 0;
  };

  explicit GatewayReader(GatewayUser& user) : user_(user) {}

  void put(std::span<const std::uint8_t> bytes);

  /// The line was interrupted: what comes up to the next frame's end belongs to no frame.
  void on_interrupted();

  const Counters& counters() const { return counters_; }

 private:
  void end_frame();
  std::size_t decode(std::span<std::uint8_t> payload) const;
  void take(std::span<const std::uint8_t> payload);
  void count_sequence(std::uint8_t sequence);
  void take_ticks(std::uint16_t ticks);
  void take_reception(std::span<const std::uint8_t> payload);
  void take_version(std::span<const std::uint8_t> payload);
  void take_hello(std::span<const std::uint8_t> payload);

  GatewayUser& user_;
  Counters counters_;
  std::array<std::uint8_t, kGatewayFrameMax> frame_{};  // as on the wire, without the end
  std::size_t size_ = 0;
  bool is_too_long_ = false;
  bool is_synchronised_ = false;  // a frame's end has been seen
  std::optional<std::uint8_t> last_sequence_;
  std::optional<std::uint16_t> last_ticks_;
  std::optional<std::uint16_t> last_drops_;
};

}  // namespace swarmtalk::kilobot_bridge
