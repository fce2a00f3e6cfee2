// What the sending and the receiving program of one run share: a page of memory, so that the sender
// knows how far the receiver is and latency needs no room in the message. One sender, one receiver.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace peers {

/// A message's first 4 bytes are its number, little-endian, counted from 0.
constexpr std::size_t kNumberBytes = 4;
constexpr std::size_t kMaxMessages = std::size_t{1} << 22;

struct Shared {
  std::atomic<std::uint32_t> receiver_ready;
  std::atomic<std::uint32_t> received;              // messages
  std::atomic<std::int64_t> sent_ns[kMaxMessages];  // CLOCK_MONOTONIC, by message number
};

/// Maps `path`, which is made if it is not there. Throws std::system_error.
Shared& map_shared(const std::string& path);

std::int64_t now_ns();

/// CPU time of this process so far, all threads, in us.
double cpu_us();

/// One program's part of the measurement, the same for all systems.
///
///     PROGRAM receive SHARED COUNT BYTES
///     PROGRAM send SHARED COUNT BYTES GAP_US|window=N
///
/// send: one message every GAP_US, or as fast as N unreceived messages allow. Each prints one line
/// of JSON at its end.
struct Run {
  bool is_sender = false;
  Shared* shared = nullptr;
  std::uint32_t count = 0;
  std::size_t size_bytes = 0;
  std::uint32_t gap_us = 0;  // 0: windowed
  std::uint32_t window = 0;
};

/// Exits with a line on stderr if the arguments are wrong.
Run parse(int argc, char** argv);

/// The receiving program's account. on_message() may be called by any one thread.
class Receiver {
 public:
  explicit Receiver(const Run& run);
  void ready();
  /// @return true when the last message has come
  bool on_message(const void* bytes, std::size_t size);
  bool is_complete() const { return complete_.load(); }
  /// True when nothing has come for ten seconds: the run has lost messages.
  bool has_stalled() const;
  /// @return the program's exit code
  int report() const;

 private:
  const Run& run_;
  double cpu_before_us_ = 0;
  std::vector<float> latencies_us_;
  std::int64_t first_ns_ = 0;
  std::atomic<std::int64_t> last_ns_;
  std::atomic<bool> complete_{false};
};

/// Paces a sender. Class System has
///   bool send(const char* bytes, std::size_t size);  // false: full, ask again after wait()
///   void wait(std::uint32_t us);                      // lets its own events happen for that long
///   void flush();                                     // until everything has left
template <class System>
int run_sender(const Run& run, System& system);

}  // namespace peers

#include "benchmarks/peers/window_sender.hpp"
