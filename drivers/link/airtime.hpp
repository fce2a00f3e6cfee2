// How long a link's frames keep the air busy: an estimate from what the link counts anyway, where
// the rate at which the radio broadcasts is known. Owned by a link. Reads no clock.
#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/link/link_counters.hpp"

namespace swarmtalk::drivers {

/// Air time of `frames` broadcasts with `bytes` of payload in all, in microseconds, as if they
/// never collided. Per frame: 36 bytes of headers (802.11 MAC 24, LLC and SNAP 8, FCS 4), and
/// before it DIFS, mean backoff and preamble. With 802.11b (1, 2, 5.5 and 11 Mb/s) these take 50,
/// 310 and 192 us; with OFDM in the 2.4 GHz band 28, 67.5 and 20 us, and 4 us of rounding up and
/// 6 us of signal extension come on top.
/// Source: IEEE 802.11-2016, clauses 10.22.2, 16.2 and 18.4.
/// @param rate_mbps  above 0
double airtime_us(std::uint64_t frames, std::uint64_t bytes, double rate_mbps);

class AirtimeMeter {
 public:
  /// @param network_header_bytes  that each frame has on the air beside the air frame: IP and UDP
  explicit AirtimeMeter(std::size_t network_header_bytes)
      : network_header_bytes_(network_header_bytes) {}

  /// From now on broadcasts leave at this rate; 0: not known, no estimate.
  void set_rate(double rate_mbps, const LinkCounters& now);

  double rate_mbps() const { return rate_mbps_; }

  /// Fills in the air time of all frames so far.
  void fill(LinkCounters& counters) const;

 private:
  double since(std::uint64_t frames, std::uint64_t bytes) const;

  std::size_t network_header_bytes_;
  double rate_mbps_ = 0.0;
  LinkCounters before_;  // when the rate changed last
  double sent_before_us_ = 0.0;
  double received_before_us_ = 0.0;
};

}  // namespace swarmtalk::drivers
