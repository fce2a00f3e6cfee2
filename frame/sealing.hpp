// Sealer and Opener: the two ends of a link with a swarm key (docs/wire-format.md, sealed frames).
// A FrameWriter with a Sealer writes sealed frames; an Opener takes the place of parse() and
// applies the key's rules, replays included. One of each for each link, on the link's thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "frame/air_frame.hpp"
#include "frame/swarm_key.hpp"

namespace swarmtalk::frame {

using SealSession = std::array<std::uint8_t, kSessionBytes>;

class Sealer {
 public:
  /// Draws a session. @param key  kept
  explicit Sealer(std::shared_ptr<const SwarmKey> key);
  /// With a session of the caller's: for vectors and tests.
  Sealer(std::shared_ptr<const SwarmKey> key, const SealSession& session);

  /// Another session: the frame counter is about to start over.
  void draw_session();

  const SealSession& session() const { return session_; }
  const SwarmKey& key() const { return *key_; }

  /// Encrypts a frame in place. @param frame  header, key id, session, plaintext, and room for the
  /// tag; the length is written already
  void seal(std::span<std::uint8_t> frame) const;

 private:
  std::shared_ptr<const SwarmKey> key_;
  SealSession session_;
};

/// Which frames of which sessions have been heard.
class ReplayWindow {
 public:
  static constexpr std::size_t kSessions = 512;  // remembered; the one unheard longest is forgotten
  static constexpr std::uint32_t kFrames = 64;   // how far back a late frame is told from a replay

  /// SealSession, epoch and node as they stand in a frame.
  using Id = std::array<std::uint8_t, kSessionBytes + 4 + 2>;

  bool is_fresh(const Id& id, std::uint32_t counter) const;
  /// @pre is_fresh(id, counter)
  void remember(const Id& id, std::uint32_t counter);

 private:
  struct Heard {
    Id id;
    std::uint32_t newest = 0;
    std::uint64_t seen = 0;  // bit n: newest - n
    std::uint64_t last_used = 0;
  };

  std::vector<Heard> sessions_;
  std::uint64_t uses_ = 0;
};

/// Reads frames of a link with a key, or of one without: then only what is not sealed is taken.
class Opener {
 public:
  /// @param key  kept; null: none
  explicit Opener(std::shared_ptr<const SwarmKey> key = nullptr) : key_(std::move(key)) {}

  /// Frames of this session are our own, played back.
  void refuse(const SealSession& own) { own_ = own; }

  /// Like parse(), and the key's rules. frame.packets may point into this object, until the next
  /// call.
  ParseResult open(std::span<const std::uint8_t> bytes, Frame& frame);

 private:
  ParseResult open_sealed(std::span<const std::uint8_t> bytes, const SealedFrame& sealed,
                          Frame& frame);

  std::shared_ptr<const SwarmKey> key_;
  std::array<std::uint8_t, kSessionBytes> own_{};
  ReplayWindow window_;
  std::vector<std::uint8_t> plaintext_;
};

}  // namespace swarmtalk::frame
