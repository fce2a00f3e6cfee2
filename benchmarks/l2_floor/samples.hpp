// What the measurements have in common: messages that carry their send time, and what is reported.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace swarmtalk::l2_floor {

// Not the protocol's own EtherType: a lab's daemons then neither hear nor count these frames.
inline constexpr std::uint16_t kEthertype = 0x88B6;
inline constexpr std::size_t kSmallestMessageBytes = 8;  // the send time

struct Result {
  std::size_t messages = 0;
  double p50_us = 0.0;
  double p99_us = 0.0;
  double cpu_us = 0.0;  // of this process, per message
};

std::int64_t now_ns();  // CLOCK_MONOTONIC: one clock for all processes of a machine
double cpu_us();        // of this process, so far

void stamp(std::span<std::uint8_t> message);

class Samples {
 public:
  explicit Samples(std::size_t expected) { latencies_us_.reserve(expected); }

  void add(std::span<const std::uint8_t> message);
  std::size_t count() const { return latencies_us_.size(); }

  /// @param cpu_spent_us  of this process, for all messages
  Result result(double cpu_spent_us) const;

 private:
  std::vector<double> latencies_us_;
};

double median(std::vector<double> values);

}  // namespace swarmtalk::l2_floor
