// How well a frame is received over a distance at a rate: a law of path loss, and a curve of losses
// around each rate's sensitivity. No fading, no collisions, no air time: what is lost is drawn for
// each frame by itself. Pure functions; the medium of a Wi-Fi guest asks them.
#pragma once

#include <cstddef>
#include <cstdint>

namespace swarmtalk::wifi {

/// A legacy rate in units of 100 kbit/s: 10, 20, 55, 110 (DSSS), 60 to 540 (OFDM).
using Rate = std::uint16_t;

/// The rate that a driver of mac80211_hwsim means by an index.
/// @param index          from 0 on, of the band's table: 1 2 5.5 11 6 9 12 18 24 36 48 54 Mbit/s in
///                       the 2.4 GHz band, the same from 6 on above it
/// @param frequency_mhz  of the channel
/// @return 0 when the band has no such rate
Rate rate_of(int index, std::uint32_t frequency_mhz);

/// Weakest signal, dBm, at which one frame of 1000 bytes in ten is lost. OFDM: IEEE 802.11-2020,
/// table 17-18 (sim::wifi_rates()). DSSS: clauses 15.4.8.2 and 16.3.8.2; 1 and 5.5 Mbit/s, which
/// those leave out, are placed 3 dB under and halfway between their neighbours.
double sensitivity_dbm(Rate rate);

/// Signal at the receiver, dBm: free space to 1 m, from there on 30 dB for each tenfold distance,
/// as indoors (ITU-R P.1238, office) and on the Wi-Fi medium of `sim/`.
/// @param power_dbm   of the transmitter; @param distance_m  0 or more
double signal_dbm(double power_dbm, double distance_m, std::uint32_t frequency_mhz);

/// Probability, 0 to 1, that a frame has no error. Errors are independent, and there are a tenth of
/// them for each 1.5 dB more signal (our choice: a flat channel is steeper, a fading one gentler).
/// @param bytes  of the frame, with its header
double chance_of_reception(double signal_dbm, Rate rate, std::size_t bytes);

}  // namespace swarmtalk::wifi
