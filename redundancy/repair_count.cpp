#include "redundancy/repair_count.hpp"

#include <algorithm>
#include <cmath>

namespace swarmtalk::redundancy {
namespace {

constexpr unsigned kMostCopies = 3;

}  // namespace

double delivery(unsigned packets, unsigned repairs, double loss) {
  const unsigned all = packets + repairs;
  double sum = 0;
  double ways = 1;  // to lose `lost` of all
  for (unsigned lost = 0; lost <= repairs; ++lost) {
    sum += ways * std::pow(loss, lost) * std::pow(1 - loss, all - lost);
    ways *= static_cast<double>(all - lost) / (lost + 1);
  }
  return sum;
}

unsigned repairs_for_loss(unsigned packets, double loss) {
  const unsigned most = std::min(packets == 1 ? kMostCopies : packets, kMostRepairs);
  unsigned repairs = 0;
  while (repairs < most && delivery(packets, repairs, loss) < kWantedDelivery) ++repairs;
  return repairs;
}

}  // namespace swarmtalk::redundancy
