#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "cli/common/clock.hpp"
#include "cli/doctor/look.hpp"

namespace swarmtalk::cli::doctor {
namespace {

bool is_radio(const std::string& name) {
  struct stat status {};
  return ::stat(("/sys/class/net/" + name + "/phy80211").c_str(), &status) == 0;
}

void read_flags(InterfaceFacts& facts) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return;
  ifreq request{};
  std::memcpy(request.ifr_name, facts.name.c_str(),
              std::min<std::size_t>(facts.name.size(), IFNAMSIZ - 1));
  if (ioctl(socket, SIOCGIFFLAGS, &request) == 0) {
    facts.is_switched_on = (request.ifr_flags & IFF_UP) != 0;
    facts.has_carrier = (request.ifr_flags & IFF_RUNNING) != 0;
  }
  if (ioctl(socket, SIOCGIFMTU, &request) == 0) {
    facts.mtu_bytes = static_cast<std::size_t>(std::max(request.ifr_mtu, 0));
  }
  close(socket);
}

}  // namespace

InterfaceFacts look_at_interface(const std::string& name, nl80211::Asker* asker) {
  InterfaceFacts facts;
  facts.name = name;
  facts.index = if_nametoindex(name.c_str());
  if (facts.index == 0) return facts;
  read_flags(facts);
  if (asker != nullptr) facts.radio = look_at_radio(*asker, facts.index);
  facts.is_radio = facts.radio.has_value() || is_radio(name);
  return facts;
}

std::optional<RadioFacts> look_at_radio(nl80211::Asker& asker, unsigned index) {
  const auto interface = nl80211::interface_of(asker, index);
  if (!interface) return std::nullopt;
  RadioFacts radio;
  radio.interface = *interface;
  radio.network = nl80211::network_of(asker, index);
  radio.stations = nl80211::stations_of(asker, index);
  // Power save is a client's: other modes do not sleep.
  if (interface->mode == nl80211::Mode::kStation) {
    radio.power_save = nl80211::has_power_save(asker, index);
  }
  radio.country = nl80211::country_of(asker, interface->wiphy);
  return radio;
}

std::vector<std::string> radios() {
  std::vector<std::string> names;
  struct if_nameindex* const list = ::if_nameindex();
  for (const struct if_nameindex* entry = list; entry != nullptr && entry->if_index != 0; ++entry) {
    if (is_radio(entry->if_name)) names.emplace_back(entry->if_name);
  }
  if (list != nullptr) if_freenameindex(list);
  return names;
}

std::optional<ClockFacts> look_at_clock() {
  const auto is_synchronised = is_clock_synchronised();
  if (!is_synchronised) return std::nullopt;
  return ClockFacts{*is_synchronised};
}

}  // namespace swarmtalk::cli::doctor
