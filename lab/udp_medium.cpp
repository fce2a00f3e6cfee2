#include "lab/udp_medium.hpp"

namespace swarmtalk::lab {

std::int64_t udp_port_of(const State& state) {
  std::uint32_t hash = 2166136261u;  // FNV-1a
  // Labs of one name do not hear each other: each user's has a folder of its own.
  for (const char c : folder_of(state.name).string())
    hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  return 20000 + hash % 10000;
}

LinkKeys UdpMedium::link_of(const State& state, const Robot&) const {
  return {{"type", "udp"}, {"interface", "lo"}, {"port", udp_port_of(state)}};
}

}  // namespace swarmtalk::lab
