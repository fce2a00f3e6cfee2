// Reading a terminal as a serial line would bring the bytes, and remembering when it did: an
// emulation that a busy machine keeps waiting then still sees its host's silences as long as the
// host made them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>

#include "emulation/kilobot/pty.hpp"

namespace swarmtalk::emulator {

struct TimedByte {
  std::uint8_t byte = 0;
  std::uint64_t at_ns = 0;  // when its last bit was on the line
};

/// Puts the calling thread before all others that want the processor, where that is allowed (root):
/// who reads late finds a silence of the host shortened. It must sleep for kLinePoll at each pass.
void read_before_others();
inline constexpr auto kLinePoll = std::chrono::microseconds(500);

/// Takes bytes from a terminal no faster than a line does: a pseudo terminal itself has no speed.
class PacedReader {
 public:
  PacedReader(Pty& terminal, std::uint64_t byte_ns) : terminal_(terminal), byte_ns_(byte_ns) {}

  /// @param now_ns  a clock that never goes back, the same in every call
  /// @return the next byte that the line has brought by now
  std::optional<TimedByte> next(std::uint64_t now_ns);

 private:
  Pty& terminal_;
  std::uint64_t byte_ns_;
  std::uint64_t line_free_ns_ = 0;
};

/// Does so in a thread of its own, by CLOCK_MONOTONIC.
class TerminalReader {
 public:
  TerminalReader(Pty& terminal, std::uint64_t byte_ns);
  ~TerminalReader();
  TerminalReader(const TerminalReader&) = delete;
  TerminalReader& operator=(const TerminalReader&) = delete;

  /// @return the oldest byte not yet taken, if it came until then
  std::optional<TimedByte> take(std::uint64_t until_ns);

 private:
  void run();
  bool has_room();

  Pty& terminal_;
  PacedReader reader_;
  std::mutex mutex_;
  std::deque<TimedByte> bytes_;
  std::atomic<bool> is_stopping_ = false;
  int wake_ = -1;  // eventfd
  std::thread thread_;
};

}  // namespace swarmtalk::emulator
