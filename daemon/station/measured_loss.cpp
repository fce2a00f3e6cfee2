#include "daemon/station/measured_loss.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <vector>

namespace swarmtalk::daemon {

double MeasuredLoss::of(const Neighbours& neighbours, Neighbour::Time now) {
  if (now - looked_at_ >= std::chrono::seconds(1)) {
    looked_at_ = now;
    loss_ = of(neighbours.list(now));
  }
  return loss_;
}

double MeasuredLoss::of(std::span<const Neighbour> neighbours) {
  std::vector<double> losses;
  for (const Neighbour& each : neighbours) {
    if (each.frames + each.frames_lost >= kLeastFrames) losses.push_back(each.loss());
  }
  if (losses.empty()) return 0;
  const std::size_t place = (3 * losses.size() + 3) / 4 - 1;
  std::nth_element(losses.begin(), losses.begin() + static_cast<std::ptrdiff_t>(place),
                   losses.end());
  return losses[place];
}

}  // namespace swarmtalk::daemon
