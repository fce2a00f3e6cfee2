// OwnNonces: the nonces that a robot has put into its frames lately (docs/wire-format.md, fresh
// frames). Who sends one back has made its frame since the nonce was drawn.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace swarmtalk::frame {

class OwnNonces {
 public:
  using Ms = std::uint64_t;
  using Nonce = std::array<std::uint8_t, 6>;
  using Draw = std::function<void(std::span<std::uint8_t>)>;  // random bytes

  static constexpr Ms kRollMs = 1000;       // age at which a nonce gets a successor
  static constexpr Ms kAnswerMs = 2500;     // ... and at which it proves nothing any more
  static constexpr std::size_t kKept = 64;  // more than a minute: a robot may be stopped for long

  /// Draws one if there is none, or the newest is at least so old.
  void roll(Ms now, const Draw& draw, Ms least_age = kRollMs);

  /// REQUIRES roll() before
  const Nonce& newest() const { return drawn_.back().bytes; }

  /// When the newest of ours in `answers` (nonces, one behind the other) was drawn, if it still
  /// proves something at `at`.
  std::optional<Ms> proof_in(std::span<const std::uint8_t> answers, Ms at) const;

 private:
  struct Drawn {
    Nonce bytes;
    Ms at;
  };
  std::vector<Drawn> drawn_;  // the newest last; at most kKept
};

}  // namespace swarmtalk::frame
