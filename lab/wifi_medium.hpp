// The medium `wifi`: a virtual machine with Debian's kernel and simulated 802.11 radios (lab/wifi),
// in which daemons and commands run. Needs no privilege; what it needs is asked for by check. The
// work is done by the program swarmtalk-wifi-guest beside this one's other files.
#pragma once

#include <string>
#include <vector>

#include "lab/medium.hpp"

namespace swarmtalk::lab {

class WifiMedium final : public Medium {
 public:
  std::string name() const override { return "wifi"; }
  std::string problem() const override;
  void plan(State& state) const override;
  void make(State& state) const override;
  LinkKeys link_of(const State& state, const Robot& robot) const override;
  bool is_air() const override { return true; }
  void remove(const State& state) const override;
  std::vector<std::string> as_robot(const State& state, const Robot& robot,
                                    const std::vector<std::string>& command) const override;
  bool is_elsewhere() const override { return true; }
};

}  // namespace swarmtalk::lab
