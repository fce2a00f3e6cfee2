// What a simulated receiver measures, in each profile's own unit.
#pragma once

#include <cstdint>

#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/sensing.hpp"

namespace swarmtalk::sim {

/// mm as the 16 bits that the small profiles have; never negative, which would be "unknown".
inline int16_t whole_mm(double distance_mm) {
  if (distance_mm < 0) return 0;
  return distance_mm > 32766 ? int16_t{32766} : static_cast<int16_t>(distance_mm + 0.5);
}

/// @param bearing_rad  of the transmitter, counter-clockwise from the receiver's heading
inline void sense(core::DistanceSensing& out, double distance_mm, double) {
  out.distance = whole_mm(distance_mm);
}
inline void sense(core::RangeBearingSensing& out, double distance_mm, double bearing_rad) {
  out.distance = whole_mm(distance_mm);
  out.bearing_rad = static_cast<float>(bearing_rad);
}
inline void sense(core::PoseSensing& out, double distance_mm, double bearing_rad) {
  out.distance_m = static_cast<float>(distance_mm / 1000);
  out.bearing_rad = static_cast<float>(bearing_rad);
  out.link_token = 0;
}

/// Whether this sensing has a bearing at all, so that none need be worked out.
template <class Sensing>
constexpr bool kHasBearing = true;
template <>
constexpr bool kHasBearing<core::DistanceSensing> = false;

}  // namespace swarmtalk::sim
