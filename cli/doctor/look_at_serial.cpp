#include <algorithm>
#include <string_view>

#include "cli/doctor/look.hpp"
#include "serial/holders.hpp"

namespace swarmtalk::cli::doctor {
namespace {

SerialFacts look_at(const std::string& path) {
  serial::Holders holders = serial::other_holders(path);
  // There is one at most: a second daemon does not get the device.
  std::erase_if(holders.seen, [](const auto& each) { return each.program == "swarmtalkd"; });
  return {path, serial::text_of(holders.seen), holders.are_all};
}

}  // namespace

std::vector<SerialFacts> look_at_serial_devices(const DaemonFacts& daemon) {
  constexpr std::string_view kBetween = ", ";
  std::vector<SerialFacts> devices;
  for (const LinkFacts& link : daemon.links) {
    if (link.type != "kilobot") continue;
    const std::size_t end = std::min(link.device.find(kBetween), link.device.size());
    devices.push_back(look_at(link.device.substr(0, end)));
    if (end == link.device.size()) continue;
    devices.push_back(look_at(link.device.substr(end + kBetween.size())));
  }
  return devices;
}

}  // namespace swarmtalk::cli::doctor
