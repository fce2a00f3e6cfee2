// StationList: this daemon's stations, numbered in the order they were added. Whoever keeps
// something for each station counts them by it. The stations outlive it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "daemon/station/station.hpp"

namespace swarmtalk::daemon {

class StationList {
 public:
  void add(Station& station) { stations_.push_back(&station); }

  std::size_t size() const { return stations_.size(); }
  Station& operator[](std::size_t index) const { return *stations_[index]; }
  auto begin() const { return stations_.begin(); }
  auto end() const { return stations_.end(); }

  /// @pre added
  std::size_t index_of(const Station& station) const {
    return static_cast<std::size_t>(std::find(begin(), end(), &station) - begin());
  }

 private:
  std::vector<Station*> stations_;
};

}  // namespace swarmtalk::daemon
