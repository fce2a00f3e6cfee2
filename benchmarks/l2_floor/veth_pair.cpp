#include "benchmarks/l2_floor/veth_pair.hpp"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>

namespace swarmtalk::l2_floor {
namespace {

void run(const std::string& command) {
  if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
}

}  // namespace

VethPair::VethPair() : prefix_("swt-floor-" + std::to_string(getpid()) + "-") {
  for (const char side : {'a', 'b'}) {
    run("ip netns add " + name(side));
    // The kernel's own IPv6 frames would be on the wire too.
    run("ip netns exec " + name(side) +
        " sysctl -q -w net.ipv6.conf.all.disable_ipv6=1 net.ipv6.conf.default.disable_ipv6=1");
  }
  run(std::string("ip link add name ") + kInterface + " netns " + name('a') +
      " type veth peer name " + kInterface + " netns " + name('b'));
  for (const char side : {'a', 'b'}) {
    run("ip -n " + name(side) + " link set " + kInterface + " up");
  }
  // The kernel reports the carrier of a new interface within a second.
  sleep(2);
}

VethPair::~VethPair() {
  for (const char side : {'a', 'b'}) {
    if (std::system(("ip netns del " + name(side)).c_str()) != 0) std::abort();
  }
}

void VethPair::enter(char side) const {
  const int descriptor = open(("/run/netns/" + name(side)).c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0 || setns(descriptor, CLONE_NEWNET) != 0) {
    throw std::runtime_error("cannot enter the namespace " + name(side));
  }
  close(descriptor);
}

}  // namespace swarmtalk::l2_floor
