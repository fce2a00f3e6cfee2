// The medium `udp`: the daemons' UDP links on the loopback interface, without namespaces. For
// everybody. All hear all.
#pragma once

#include "lab/medium.hpp"

namespace swarmtalk::lab {

/// The UDP port of a lab: labs of different names must not hear each other.
std::int64_t udp_port_of(const State& state);

class UdpMedium final : public Medium {
 public:
  std::string name() const override { return "udp"; }
  LinkKeys link_of(const State& state, const Robot& robot) const override;
};

}  // namespace swarmtalk::lab
