#include "drivers/link/airtime.hpp"

namespace swarmtalk::drivers {
namespace {

constexpr double kHeaderBytes = 36.0;
constexpr double kDsssFrameUs = 552.0;
constexpr double kOfdmFrameUs = 125.5;
constexpr double kFastestDsssMbps = 11.0;
constexpr double kSlowestOfdmMbps = 6.0;

bool is_dsss(double rate_mbps) {
  return rate_mbps < kSlowestOfdmMbps || rate_mbps == kFastestDsssMbps;
}

}  // namespace

double airtime_us(std::uint64_t frames, std::uint64_t bytes, double rate_mbps) {
  const double count = static_cast<double>(frames);
  const double bits = 8.0 * (static_cast<double>(bytes) + kHeaderBytes * count);
  return (is_dsss(rate_mbps) ? kDsssFrameUs : kOfdmFrameUs) * count + bits / rate_mbps;
}

double AirtimeMeter::since(std::uint64_t frames, std::uint64_t bytes) const {
  if (rate_mbps_ <= 0.0) return 0.0;
  return airtime_us(frames, bytes + frames * network_header_bytes_, rate_mbps_);
}

void AirtimeMeter::set_rate(double rate_mbps, const LinkCounters& now) {
  LinkCounters until_now = now;
  fill(until_now);
  sent_before_us_ = static_cast<double>(until_now.airtime_us_sent);
  received_before_us_ = static_cast<double>(until_now.airtime_us_received);
  before_ = now;
  rate_mbps_ = rate_mbps;
}

void AirtimeMeter::fill(LinkCounters& counters) const {
  const double sent_us =
      since(counters.frames_sent - before_.frames_sent, counters.bytes_sent - before_.bytes_sent);
  const double received_us = since(counters.frames_received - before_.frames_received,
                                   counters.bytes_received - before_.bytes_received);
  counters.airtime_us_sent = static_cast<std::uint64_t>(sent_before_us_ + sent_us);
  counters.airtime_us_received = static_cast<std::uint64_t>(received_before_us_ + received_us);
}

}  // namespace swarmtalk::drivers
