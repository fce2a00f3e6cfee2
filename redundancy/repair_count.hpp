// How many repair packets a message gets: as its program asked, or as many as the loss demands that
// is measured around.
#pragma once

namespace swarmtalk::redundancy {

/// The most that one message gets. The field on the air is wider.
inline constexpr unsigned kMostRepairs = 12;

/// A message is to arrive this often.
inline constexpr double kWantedDelivery = 0.95;

/// How often a message arrives: at least `packets` of `packets + repairs`, each lost by itself.
/// @param loss  of packets, 0 to 1
double delivery(unsigned packets, unsigned repairs, double loss);

/// Repair packets with which a message arrives in kWantedDelivery of all cases, as far as that is
/// worth its air: no more than its packets, and three for a message of one packet, whose repair
/// packets need no frame of their own. @param packets  at least 1
unsigned repairs_for_loss(unsigned packets, double loss);

}  // namespace swarmtalk::redundancy
