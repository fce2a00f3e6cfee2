// SeenMessages: which messages came lately, and by which way. A daemon with several links may meet
// one message more than once: over two links, or through two gateways. Single-threaded; bounded.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace swarmtalk::daemon {

class SeenMessages {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// What names a message wherever it is met, its channel there included.
  struct Identity {
    std::uint16_t node = 0;
    std::uint16_t epoch = 0;  // 0: its numbers come back soon
    std::uint32_t number = 0;
    std::uint16_t channel = 0;
    std::span<const std::uint8_t> payload;
  };
  /// Which way it came: by which link, from whom on it.
  struct Way {
    std::size_t link = 0;
    std::uint16_t sender = 0;
    bool operator==(const Way&) const = default;
  };

  static constexpr std::size_t kMost = 2048;

  /// Whether it came by another way lately; if not, remembers that it came by this one.
  bool came_otherwise(const Identity& identity, Way way, Time now);

 private:
  struct Seen {
    Way way;
    Time at;
  };

  std::unordered_map<std::uint64_t, Seen> seen_;
  std::vector<std::uint64_t> ring_;  // keys in the order they were first seen
  std::size_t oldest_ = 0;
};

}  // namespace swarmtalk::daemon
