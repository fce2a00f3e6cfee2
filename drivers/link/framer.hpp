// FrameBuilder and FrameReceiver: what lies between a link's frames and its user's packets, once
// for all links. They count into the link's LinkCounters and own no socket and no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "drivers/link/held_frames.hpp"
#include "drivers/link/link.hpp"
#include "drivers/link/link_counters.hpp"
#include "frame/sealing.hpp"

namespace swarmtalk::drivers {

struct BuiltFrame {
  std::size_t size_bytes = 0;  // 0: there is no frame
  std::size_t packets = 0;
  bool more_waits = false;  // build again
};

/// Pulls waiting packets straight into frames.
class FrameBuilder {
 public:
  FrameBuilder(frame::ProfileId profile, std::size_t max_packet_bytes);

  /// From now on frames are sealed with it. None: they are not.
  void set_sealer(std::optional<frame::Sealer> sealer) { sealer_ = std::move(sealer); }

  /// From now on frames are fresh ones; null: not. Only with a sealer.
  void set_freshness(std::shared_ptr<frame::Freshness> freshness) {
    freshness_ = std::move(freshness);
  }
  frame::Sealer* sealer() { return sealer_ ? &*sealer_ : nullptr; }

  /// Buffer that build() needs for frames of at most `limit_bytes`: with room for a packet that
  /// fits into no frame, which is pulled to be dropped.
  std::size_t buffer_bytes(std::size_t limit_bytes) const;

  /// Fills one frame with what waits, up to the limit. A packet that does not fit any more is left
  /// where it waits, and opens the next frame; one that fits into no frame is dropped and counted.
  /// @param buffer  at least buffer_bytes(limit_bytes). @param now  for fresh frames
  BuiltFrame build(LinkUser& user, std::span<std::uint8_t> buffer, std::size_t limit_bytes,
                   LinkCounters& counters, MonotonicTime now = {});

  /// A frame without packets, with the last messages that fit. @param buffer, now  as for build()
  BuiltFrame build_beacon(LinkUser& user, std::span<std::uint8_t> buffer, std::size_t limit_bytes,
                          MonotonicTime now = {});

 private:
  frame::FrameHeader next_header(LinkUser& user, MonotonicTime now);
  /// What goes in front of the pose of a fresh frame with this header.
  std::span<const std::uint8_t> fresh_bytes(const frame::FrameHeader& header,
                                            std::size_t limit_bytes, MonotonicTime now);

  frame::ProfileId profile_;
  std::size_t max_packet_bytes_;
  std::uint32_t frames_built_ = 0;
  std::optional<frame::Sealer> sealer_;
  std::shared_ptr<frame::Freshness> freshness_;
  std::vector<std::uint8_t> fresh_;  // reused
};

/// Reads frames and hands their packets up.
class FrameReceiver {
 public:
  explicit FrameReceiver(frame::ProfileId profile) : profile_(profile) {}

  /// From now on frames are read with it.
  void set_opener(frame::Opener opener) {
    opener_ = std::move(opener);
    held_ = HeldFrames();
  }
  frame::Opener& opener() { return opener_; }

  void receive(std::span<const std::uint8_t> bytes, const FrameArrival& arrival, LinkUser& user,
               LinkCounters& counters);

 private:
  void keep(std::span<const std::uint8_t> bytes, const frame::Frame& frame,
            const FrameArrival& arrival);
  void release(std::span<const std::uint8_t> proof, const FrameArrival& arrival, LinkUser& user,
               LinkCounters& counters);
  bool hand_up(const frame::Frame& frame, const FrameArrival& arrival, LinkUser& user,
               LinkCounters& counters) const;

  frame::ProfileId profile_;
  frame::Opener opener_;
  HeldFrames held_;
};

/// Both ends of a link go over to a key; null: to none. @param also  see frame::Opener
void use_key(const std::shared_ptr<const frame::SwarmKey>& key, FrameBuilder& builder,
             FrameReceiver& receiver, const std::shared_ptr<const frame::SwarmKey>& also = nullptr);

/// The same with fresh frames. From one key to another, sessions and what is known of others go on:
/// no frame is lost by it.
/// @param epoch  of the transmitter
/// @param freshness  of the link, made and forgotten here
void use_key_freshly(const std::shared_ptr<const frame::SwarmKey>& key,
                     const std::shared_ptr<const frame::SwarmKey>& also, std::uint32_t epoch,
                     MonotonicTime now, std::shared_ptr<frame::Freshness>& freshness,
                     FrameBuilder& builder, FrameReceiver& receiver);

/// A time as Freshness counts it.
inline frame::Freshness::Ms milliseconds(MonotonicTime time) {
  const auto since = std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch());
  return static_cast<frame::Freshness::Ms>(since.count());
}

}  // namespace swarmtalk::drivers
