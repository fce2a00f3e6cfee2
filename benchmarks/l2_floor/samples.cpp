#include "benchmarks/l2_floor/samples.hpp"

#include <time.h>

#include <algorithm>
#include <cstring>

namespace swarmtalk::l2_floor {
namespace {

std::int64_t clock_ns(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

double quantile(const std::vector<double>& sorted, double q) {
  if (sorted.empty()) return 0.0;
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

}  // namespace

std::int64_t now_ns() {
  return clock_ns(CLOCK_MONOTONIC);
}

double cpu_us() {
  return static_cast<double>(clock_ns(CLOCK_PROCESS_CPUTIME_ID)) / 1000.0;
}

void stamp(std::span<std::uint8_t> message) {
  const std::int64_t now = now_ns();
  std::memcpy(message.data(), &now, sizeof now);
}

void Samples::add(std::span<const std::uint8_t> message) {
  if (message.size() < kSmallestMessageBytes) return;
  std::int64_t sent_ns = 0;
  std::memcpy(&sent_ns, message.data(), sizeof sent_ns);
  latencies_us_.push_back(static_cast<double>(now_ns() - sent_ns) / 1000.0);
}

Result Samples::result(double cpu_spent_us) const {
  std::vector<double> sorted = latencies_us_;
  std::sort(sorted.begin(), sorted.end());
  return {sorted.size(), quantile(sorted, 0.5), quantile(sorted, 0.99),
          cpu_spent_us / static_cast<double>(std::max<std::size_t>(sorted.size(), 1))};
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return quantile(values, 0.5);
}

}  // namespace swarmtalk::l2_floor
