#include <array>
#include <stdexcept>

#include "lab/bridge_medium.hpp"
#include "lab/medium.hpp"
#include "lab/network_namespace.hpp"
#include "lab/radio_medium.hpp"
#include "lab/udp_medium.hpp"
#include "lab/wifi_medium.hpp"

namespace swarmtalk::lab {
namespace {

const auto& all_media() {
  static const BridgeMedium bridge;
  static const UdpMedium udp;
  static const RadioMedium radio(true);
  static const RadioMedium radio_udp(false);
  static const WifiMedium wifi;
  static const std::array<const Medium*, 5> media{&bridge, &radio, &radio_udp, &udp, &wifi};
  return media;
}

}  // namespace

std::string choose_medium(const std::string& asked, std::string& why) {
  const std::string named = asked.empty() ? "bridge" : asked;
  if (!asked.empty() && asked != "radio") return named;
  why = why_no_namespaces();
  return why.empty() ? named : medium_named(named).without_namespaces();
}

std::vector<std::string> medium_names() {
  std::vector<std::string> names;
  for (const Medium* medium : all_media()) names.push_back(medium->name());
  return names;
}

const Medium& medium_named(const std::string& name) {
  for (const Medium* medium : all_media()) {
    if (medium->name() == name) return *medium;
  }
  throw std::runtime_error("this swarmtalk-lab knows no medium '" + name + "'");
}

}  // namespace swarmtalk::lab
