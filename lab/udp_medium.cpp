#include "lab/udp_medium.hpp"

namespace swarmtalk::lab {
namespace {

// Labs of different names must not hear each other, so each has a port of its own. FNV-1a.
std::int64_t udp_port(const std::string& lab_name) {
  std::uint32_t hash = 2166136261u;
  for (const char c : lab_name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  return 20000 + hash % 10000;
}

}  // namespace

LinkKeys UdpMedium::link_of(const State& state, const Robot&) const {
  return {{"type", "udp"}, {"interface", "lo"}, {"port", udp_port(state.name)}};
}

}  // namespace swarmtalk::lab
