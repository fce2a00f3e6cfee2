// Voices: the robots whose sealed frames have been heard (frame/freshness.hpp): those that are
// proven to live, and strangers. Reads no clock: times are milliseconds of one monotonic clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "frame/counter_window.hpp"
#include "frame/own_nonces.hpp"
#include "frame/stamp_clock.hpp"

namespace swarmtalk::frame {

/// Session and epoch as they stand in a frame, and two bytes of 0: one run of one robot.
using Voice = std::array<std::uint8_t, 12>;

/// Somebody who was heard.
struct HeardVoice {
  using Ms = OwnNonces::Ms;

  Voice voice{};
  Ms first_at = 0;
  Ms last_at = 0;
  OwnNonces::Nonce nonce{};    // its newest
  bool is_answered = false;    // ... was sent back
  bool has_asked = false;      // ... is asked for
  std::optional<Ms> asked_at;  // when we asked it last
  std::uint8_t asks = 0;       // ... how often, since it was proven last
};

struct ProvenVoice : HeardVoice {
  std::uint32_t first;  // counter of the frame that proved it first
  CounterWindow window;
  StampClock clock;
  Ms proven_at = 0;
  bool is_doubted = false;  // a frame of it was too old, or it was not proven for too long
};

class Voices {
 public:
  using Ms = OwnNonces::Ms;

  static constexpr std::size_t kMostProven = 1024;
  static constexpr std::size_t kMostStrangers = 2048;  // the oldest makes place

  /// @param now  nothing is remembered from before
  explicit Voices(Ms now) : remembers_since_(now) {}

  /// A frame of this voice came at `at`. Valid until the next call of this or of prove().
  HeardVoice& heard(const Voice& voice, Ms at);

  /// A frame has proven that its voice lives. One that is proven for the first time begins with
  /// this frame: what it sent before may have been heard by whoever we were before our start.
  /// @param drawn_at  the nonce that it sent back
  void prove(const Voice& voice, std::uint32_t counter, std::uint32_t stamp, Ms drawn_at, Ms at);

  /// nullptr: it is not proven.
  const ProvenVoice* find_proven(const Voice& voice) const;
  ProvenVoice* find_proven(const Voice& voice) {
    return const_cast<ProvenVoice*>(std::as_const(*this).find_proven(voice));
  }
  /// nullptr: it is proven, or was not heard.
  const HeardVoice* find_stranger(const Voice& voice) const;
  HeardVoice* find_stranger(const Voice& voice) {
    return const_cast<HeardVoice*>(std::as_const(*this).find_stranger(voice));
  }

  std::span<ProvenVoice> proven() { return proven_; }
  std::span<const ProvenVoice> proven() const { return proven_; }
  std::span<HeardVoice> strangers() { return strangers_; }
  std::span<const HeardVoice> strangers() const { return strangers_; }

  /// Proven voices that made place for others.
  std::uint64_t evicted() const { return evicted_; }
  /// The start, or when a proven voice was forgotten last.
  Ms remembers_since() const { return remembers_since_; }

 private:
  void add(const ProvenVoice& made, Ms at);

  std::vector<ProvenVoice> proven_;
  std::vector<HeardVoice> strangers_;
  std::uint64_t evicted_ = 0;
  Ms remembers_since_;
};

}  // namespace swarmtalk::frame
