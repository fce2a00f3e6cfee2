#include <ifaddrs.h>
#include <net/if.h>
#include <sys/socket.h>

#include "cli/common/clock.hpp"
#include "cli/doctor/look.hpp"

namespace swarmtalk::cli::doctor {
namespace {

bool has_ipv4_address(const std::string& name) {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return true;  // not told
  bool has_one = false;
  for (const ifaddrs* each = list; each != nullptr; each = each->ifa_next) {
    const bool is_ipv4 = each->ifa_addr != nullptr && each->ifa_addr->sa_family == AF_INET;
    if (is_ipv4 && name == each->ifa_name) has_one = true;
  }
  freeifaddrs(list);
  return has_one;
}

}  // namespace

InterfaceFacts look_at_interface(const std::string& name, nl80211::Asker* asker) {
  InterfaceFacts facts;
  static_cast<InterfaceInfo&>(facts) = InterfaceAsker().find(name);
  facts.name = name;
  if (facts.index == 0) return facts;
  facts.has_ipv4_address = has_ipv4_address(name);
  if (asker != nullptr) facts.radio = look_at_radio(*asker, facts.index);
  facts.is_radio = facts.is_radio || facts.radio.has_value();
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
