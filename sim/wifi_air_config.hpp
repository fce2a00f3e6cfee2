// What the Wi-Fi medium (wifi_air.hpp) is made of, and what it counts. Lengths in mm, times in us,
// powers as multiples of the weakest that is received at 6 Mb/s.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace swarmtalk::sim {

/// A rate of OFDM in a channel of 20 MHz. Source: IEEE 802.11-2020, tables 17-4 and 17-18.
struct WifiRate {
  uint32_t mbps;
  uint32_t bits_per_symbol;  // of data, every 4 us
  double more_db;            // a receiver needs so much more than at 6 Mb/s
};

/// All of them, the slowest first.
const std::vector<WifiRate>& wifi_rates();

/// Defaults are those of a broadcast in the 5 GHz band; the 2.4 GHz band's SIFS is 6 us shorter and
/// its frames 6 us longer, which is the same for a broadcast. Source of the times and of the
/// window: IEEE 802.11-2020, table 17-21. Sources of what a receiver needs: docs/radio.md.
struct WifiAirConfig {
  double range_mm = 50000;     // of a frame at 6 Mb/s with nobody else on the air
  double path_exponent = 3;    // power falls with this power of the distance
  double loss = 0;             // share of receptions that fail, each by itself
  uint32_t rate_mbps = 6;      // one of wifi_rates(); faster ones do not reach as far
  uint32_t queue_frames = 64;  // that wait in a transmitter; more are dropped
  uint32_t header_bytes = 14;  // in front of a frame's payload that do not go on the air
  uint32_t slot_us = 9;        // of backoff
  uint32_t sifs_us = 16;       // DIFS is this and two slots
  uint32_t window_slots = 15;  // backoff is drawn from 0 to this; a broadcast never doubles it
  uint32_t detection_us = 4;   // a carrier is noticed so long after it began
  double detection_db = 4;     // above noise and all others, to notice a preamble
  double payload_db = 1;       // the same, to read the rest of the frame at 6 Mb/s
  double noise_db = -12;       // beside the weakest power that is received
  double energy_busy_db = 20;  // what is not recognised as a frame keeps others silent from here
  double unheard_db = -9;      // weaker ones neither arrive nor disturb
};

/// What became of frames: of all stations, or of one. The losses are a receiver's.
/// `expected` counts each other station for each frame sent, and is the sum of those below it.
struct WifiAirCounters {
  uint64_t offered = 0;          // frames that a station wanted to send
  uint64_t lost_queue_full = 0;  // of those: its queue was full
  uint64_t sent = 0;             // of those: went on the air
  uint64_t deferred = 0;         // of those: found the air taken
  uint64_t air_us = 0;           // how long they were on the air
  uint64_t expected = 0;
  uint64_t received = 0;
  uint64_t lost_range = 0;      // too far away
  uint64_t lost_collision = 0;  // another frame was on the air at the receiver
  uint64_t lost_sending = 0;    // half duplex: the receiver was sending
  uint64_t lost_noise = 0;      // WifiAirConfig::loss
  uint64_t lost_link = 0;       // the loss of this link alone
  uint64_t lost_jam = 0;
  uint64_t lost_partition = 0;
  uint64_t lost_receiver = 0;  // the receiver's own interface did not take it
};

/// Name, member and meaning of each loss, in the order in which they are shown.
struct WifiAirLoss {
  const char* name;
  uint64_t WifiAirCounters::*count;
  const char* meaning;
};
const std::vector<WifiAirLoss>& wifi_air_losses();

}  // namespace swarmtalk::sim
