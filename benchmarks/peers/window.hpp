// What the programs of one run share: memory, so that the sender knows how far the receivers are
// and latency needs no room in the message. One sender and up to 64 receivers; or a swarm, in which
// all do both.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace peers {

/// A message's first 4 bytes are its number, little-endian, counted from 0. In a swarm each robot
/// counts from its index times kSwarmMessages.
constexpr std::size_t kNumberBytes = 4;
constexpr std::uint32_t kRobots = 64;
constexpr std::uint32_t kSwarmMessages = 1u << 16;
constexpr std::size_t kMaxMessages = std::size_t{1} << 22;

struct Shared {
  std::atomic<std::uint32_t> ready;              // programs
  std::atomic<std::uint32_t> done;               // robots of a swarm that have sent and heard all
  std::atomic<std::int64_t> begin_ns;            // of a swarm; 0: not yet known
  std::atomic<std::uint32_t> received[kRobots];  // messages, by receiver
  std::atomic<std::int64_t> sent_ns[kMaxMessages];  // CLOCK_MONOTONIC, by message number
};

/// Maps `path`, which is made if it is not there. Throws std::system_error.
Shared& map_shared(const std::string& path);

std::int64_t now_ns();

/// CPU time of this process so far, all threads, in us.
double cpu_us();

/// One program's part of the measurement, the same for all systems.
///
///     PROGRAM receive SHARED COUNT BYTES [INDEX]
///     PROGRAM send SHARED COUNT BYTES GAP_US|window=N [RECEIVERS]
///     PROGRAM swarm SHARED COUNT BYTES GAP_US INDEX ROBOTS
///
/// send: one message every GAP_US, or as fast as N messages allow that the slowest has not
/// received. swarm: each robot publishes COUNT messages, one every GAP_US, the robots' phases
/// spread, and hears all others'. Each prints one line of JSON at its end.
struct Run {
  bool is_sender = false;
  bool is_swarm = false;
  std::uint32_t index = 0;   // of this receiver or robot
  std::uint32_t robots = 1;  // receivers, or robots of the swarm

  /// Messages that the slowest receiver has.
  std::uint32_t slowest() const {
    std::uint32_t least = shared->received[0].load();
    for (std::uint32_t i = 1; i < robots; ++i) {
      least = std::min(least, shared->received[i].load());
    }
    return least;
  }

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

/// One robot's account of a swarm. on_message() may be called by any one thread.
class SwarmEar {
 public:
  explicit SwarmEar(const Run& run);
  /// Ignores what is not another robot's message of this run.
  void on_message(const void* bytes, std::size_t size);
  std::uint32_t heard() const { return heard_.load(); }
  /// @return the program's exit code
  int report(double cpu_us) const;

 private:
  const Run& run_;
  std::vector<float> latencies_us_;
  std::atomic<std::uint32_t> heard_{0};
};

/// A robot of a swarm. Class System has send() as above, and
///   void listen(std::uint32_t us);  // for that long; what comes goes to the SwarmEar
template <class System>
int run_swarm(const Run& run, SwarmEar& ear, System& system);

}  // namespace peers

#include "benchmarks/peers/window_sender.hpp"
