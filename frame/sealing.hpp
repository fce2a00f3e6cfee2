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
#include "frame/counter_window.hpp"
#include "frame/freshness.hpp"
#include "frame/swarm_key.hpp"

namespace swarmtalk::frame {

using SealSession = std::array<std::uint8_t, kSessionBytes>;

/// Who speaks in a session: an id that changes does not make it another voice.
Freshness::Voice voice_of(const SealSession& session, std::uint32_t epoch);

/// Random bytes for Freshness, which an attacker cannot guess.
void draw_random(std::span<std::uint8_t> out);

class Sealer {
 public:
  /// Draws a session. @param key  kept
  explicit Sealer(std::shared_ptr<const SwarmKey> key);
  /// With a session of the caller's: for vectors and tests.
  Sealer(std::shared_ptr<const SwarmKey> key, const SealSession& session);

  /// Another session: the frame counter is about to start over.
  void draw_session();

  /// Goes on in the same session with another key.
  void change_key(std::shared_ptr<const SwarmKey> key) { key_ = std::move(key); }

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
  static constexpr std::uint32_t kFrames = CounterWindow::kFrames;

  /// SealSession, epoch and node as they stand in a frame.
  using Id = std::array<std::uint8_t, kSessionBytes + 4 + 2>;

  bool is_fresh(const Id& id, std::uint32_t counter) const;
  /// @pre is_fresh(id, counter)
  void remember(const Id& id, std::uint32_t counter);

 private:
  struct Heard {
    Id id;
    CounterWindow window;
    std::uint64_t last_used = 0;
  };

  std::vector<Heard> sessions_;
  std::uint64_t uses_ = 0;
};

/// Reads frames of a link with a key, or of one without: then only what is not sealed is taken.
class Opener {
 public:
  /// @param key  kept; null: none
  /// @param also  another key whose frames are taken as well, while keys are changed; null: none
  explicit Opener(std::shared_ptr<const SwarmKey> key = nullptr,
                  std::shared_ptr<const SwarmKey> also = nullptr)
      : key_(std::move(key)), also_(std::move(also)) {}

  /// Other keys, and what was heard stays heard.
  void change_keys(std::shared_ptr<const SwarmKey> key, std::shared_ptr<const SwarmKey> also) {
    key_ = std::move(key);
    also_ = std::move(also);
  }

  /// From now on only fresh frames are taken, and it judges them. Null: all that are sealed are.
  void check_freshness(std::shared_ptr<Freshness> freshness) { freshness_ = std::move(freshness); }

  /// What was heard before is read again: for captures, never for a link.
  void take_repeats() { takes_repeats_ = true; }

  /// Frames of this session are our own, played back.
  void refuse(const SealSession& own) { own_ = own; }

  /// Like parse(), and the key's rules. frame.packets may point into this object, until the next
  /// call.
  /// @param at  the frame's arrival, for Freshness
  ParseResult open(std::span<const std::uint8_t> bytes, Frame& frame, Freshness::Ms at = 0);

  /// Of a sealed frame: who speaks in it.
  static Freshness::Voice voice_in(std::span<const std::uint8_t> bytes);

  /// After open() has told kNotProven: whether its robot may soon show that it lives, so that it is
  /// worth keeping the frame for open_held().
  bool may_be_proven(std::span<const std::uint8_t> bytes, Freshness::Ms at) const;

  /// Whether the last open() has shown that the frame's robot lives.
  bool has_proven() const { return freshness_ != nullptr && freshness_->has_proven(); }

  /// Like open(), of a frame that was not proven when it came. `frame` of the last open() stays
  /// valid. @param at  now: the arrival of the frame that proved its robot
  ParseResult open_held(std::span<const std::uint8_t> bytes, Frame& frame, Freshness::Ms at);

 private:
  ParseResult open_sealed(std::span<const std::uint8_t> bytes, const SealedFrame& sealed,
                          Frame& frame, Freshness::Ms at);
  const SwarmKey* key_of(std::span<const std::uint8_t> bytes) const;
  static bool decrypt(std::span<const std::uint8_t> bytes, const SealedFrame& sealed,
                      const SwarmKey& key, std::vector<std::uint8_t>& plaintext);
  ParseResult judge(std::span<const std::uint8_t> bytes, std::uint32_t counter, Freshness::Ms at,
                    std::size_t& used);

  std::shared_ptr<const SwarmKey> key_;
  std::shared_ptr<const SwarmKey> also_;
  std::shared_ptr<Freshness> freshness_;
  std::array<std::uint8_t, kSessionBytes> own_{};
  ReplayWindow window_;
  bool takes_repeats_ = false;
  std::vector<std::uint8_t> plaintext_;
  std::vector<std::uint8_t> held_plaintext_;
};

}  // namespace swarmtalk::frame
