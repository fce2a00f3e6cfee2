// Link: one medium as a station sees it. A station owns its links' other end (LinkUser); the link
// pulls packets when the air is free and hands up what it hears. Everything runs on the daemon's
// one thread, driven by one boost::asio::io_context.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/link/pacer.hpp"
#include "frame/air_frame.hpp"
#include "frame/swarm_key.hpp"

namespace swarmtalk::drivers {

using MonotonicTime = std::chrono::steady_clock::time_point;  // CLOCK_MONOTONIC on Linux

/// When a frame came, and what the kernel lost before it.
struct FrameArrival {
  MonotonicTime received_at;  // kernel's stamp where there is one, else now
  std::uint64_t kernel_drops = 0;
  bool is_time_known = true;
  std::uint64_t hardware = 0;
  bool has_our_hardware = false;  // and is not our own
};

/// What a link knows about the frame in which a packet came.
struct FrameReception {
  std::uint16_t transmitter = 0;  // node id of the last transmitter
  std::uint32_t transmitter_epoch = 0;
  std::uint32_t frame_counter = 0;       // transmitter's count of frames in this epoch
  std::optional<frame::FramePose> pose;  // of the transmitter
  MonotonicTime received_at;             // kernel's stamp where there is one, else now
  // Of a link whose receiver measures the transmitter itself; others leave it to the poses.
  std::optional<float> distance_m = {};
  std::uint64_t kernel_drops = 0;  // frames that the socket's full buffer lost before this one
  bool is_time_known = true;       // false: the wall clock was set, received_at is when it was read
  std::uint64_t hardware = 0;      // transmitter's address on the medium; 0: not known
  bool is_ghost = false;           // the transmitter says that it is simulated
  bool has_our_hardware = false;   // another's, and its address is that of this link's interface
};

/// Upper end of a link. Called by the link only, on the io_context's thread.
class LinkUser {
 public:
  virtual ~LinkUser() = default;

  /// Next packet to transmit into `out`. @return bytes; 0: none waits, or the next is longer than
  /// `out`: it stays where its waiting is measured
  virtual std::size_t pull_packet(std::span<std::uint8_t> out) = 0;

  /// Bytes of the packet that is next; 0: none waits.
  virtual std::size_t next_packet_bytes() = 0;

  /// Something waits, and all of it is of others, to be sent on.
  virtual bool has_forwards_only() { return false; }

  /// One received packet. `packet` is valid during the call only.
  virtual void on_packet(std::span<const std::uint8_t> packet, const FrameReception& frame) = 0;

  /// For a beacon: the last message that has left on as many channels as `out` has room for; where
  /// that is not enough, others the next time. @return how many
  virtual std::size_t last_messages(std::span<frame::LastMessage> /*out*/) { return 0; }

  /// A beacon came: on this channel the transmitter has sent as much by now.
  virtual void on_last_message(const frame::LastMessage& /*last*/,
                               const FrameReception& /*frame*/) {}

  /// A readable frame came, with or without packets; its packets have been handed up.
  virtual void on_frame(const FrameReception& /*frame*/) {}

  /// Link::is_up() has changed. Of links that notice it themselves.
  virtual void on_link_state() {}

  /// Whether a frame with this header is our own, come back.
  virtual bool is_own_frame(const frame::FrameHeader& /*header*/) { return false; }

  /// Header of the frame that is about to leave: node id, epoch, pose. The link fills in the rest.
  virtual frame::FrameHeader frame_header() = 0;
};

/// Name and value of a counter, as status and metrics show it. Names are literals, snake_case and
/// stable: a list costs one allocation, also when a capture asks for it twice a frame.
using Counters = std::vector<std::pair<std::string_view, std::uint64_t>>;

/// How a link was set, for who looks for a fault. What does not apply to a link is empty or 0.
struct LinkSettings {
  std::string interface;  // network interface; empty: none, or the routing table's choice
  std::uint16_t ethertype = 0;
  bool is_sealed = false;    // with a swarm key
  double air_rate_mbps = 0;  // at which the radio broadcasts, as configured
  // That a frame of others' packets waits at most; none: the link does not pace frames.
  std::optional<std::chrono::microseconds> forward_jitter;
  std::optional<std::size_t> asked_buffer_bytes;  // receive buffer, where one was configured
  std::size_t given_buffer_bytes = 0;             // by the kernel
};

/// An address on the medium and how strong its frames are.
using Signals = std::vector<std::pair<std::uint64_t, int>>;  // FrameReception::hardware, dBm

class Link {
 public:
  virtual ~Link() = default;

  /// Begins to receive and transmit. Opened in the constructor, which throws std::runtime_error
  /// with one clear line (what, which device, remedy) when it cannot.
  virtual void start(LinkUser& user) = 0;

  /// Something waits to be pulled. Cheap, may be called for every message.
  virtual void wake() = 0;

  /// The same at this time, at the latest; may be called for every packet. A link that does not
  /// know how wakes when something else does.
  virtual void wake_at(MonotonicTime /*time*/) {}

  /// From now on frames are sealed with this key, and only such are taken; null: none. Frames of a
  /// link that has no room for a seal stay as they are; the configuration refuses keys there.
  virtual void set_key(std::shared_ptr<const frame::SwarmKey> /*key*/) {}

  /// Before set_key(). Frames sealed with this key will be taken as well, while keys are changed;
  /// null: none.
  virtual void set_also_key(std::shared_ptr<const frame::SwarmKey> /*key*/) {}

  /// Before set_key(). Whether sealed frames have to be of now (frame/freshness.hpp); not where
  /// what was recorded is played, or nothing is sent.
  virtual void set_freshness(bool /*is_on*/) {}

  /// From now on this pace.
  virtual void set_pacing(const PacerConfig& /*pacing*/) {}

  /// When nothing else left for so long, a frame without packets leaves; 0: never.
  virtual void set_beacon(std::chrono::milliseconds /*interval*/) {}

  /// The rate at which the radio broadcasts; 0: not known, no estimate of air time.
  virtual void set_air_rate(double /*rate_mbps*/) {}

  /// Longest packet that the medium carries now; a longer one is dropped and counted.
  virtual std::size_t packet_limit_bytes() const { return SIZE_MAX; }

  /// An address of FrameReception::hardware for a person: "02:00:00:00:00:01", "10.0.0.1:4000".
  virtual std::string hardware_text(std::uint64_t /*hardware*/) const { return ""; }

  virtual LinkSettings settings() const { return {}; }

  /// How strong those are whom the radio hears directly, where the kernel tells it without a
  /// privilege. Asks the kernel, at most half a second: not for each frame.
  virtual Signals signals() { return {}; }

  /// Before start(): the error that a daemon ends with if no link of it can start; empty: this one
  /// can. It comes up by itself when what it misses is there.
  virtual std::string missing() const { return ""; }

  virtual bool is_up() const = 0;
  virtual std::string state() const = 0;   // one line for a person
  virtual std::string type() const = 0;    // "raw_l2"
  virtual std::string device() const = 0;  // "wlan0"
  virtual Counters counters() const = 0;
};

}  // namespace swarmtalk::drivers
