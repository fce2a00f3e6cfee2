// SwarmKey: the secret that all robots of a swarm share (docs/wire-format.md, sealed frames). Made
// once from a key file, kept by the links that use it, wiped from memory at its end.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace swarmtalk::frame {

class SwarmKey {
 public:
  static constexpr std::size_t kBytes = 32;

  /// @throws std::runtime_error  libsodium cannot start (no source of random numbers)
  explicit SwarmKey(std::span<const std::uint8_t, kBytes> bytes);
  SwarmKey(const SwarmKey&) = delete;
  SwarmKey& operator=(const SwarmKey&) = delete;
  ~SwarmKey();

  const std::uint8_t* bytes() const { return bytes_; }

  /// What a frame says of its key, 2 bytes.
  const std::array<std::uint8_t, 2>& id() const { return id_; }

 private:
  std::uint8_t* bytes_;  // in pages of their own: never swapped out, read-only, wiped
  std::array<std::uint8_t, 2> id_;
};

}  // namespace swarmtalk::frame
