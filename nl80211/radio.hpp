// What the kernel's 802.11 tells of one interface: mode, network, rates, stations, power save,
// country. Reads the answers of an Asker (NL80211_CMD_GET_...); keeps nothing, decides nothing.
// What the kernel did not tell is empty. Values as in linux/nl80211.h and IEEE 802.11-2020, 9.4.2.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nl80211/asker.hpp"

namespace swarmtalk::nl80211 {

enum class Mode { kOther, kStation, kAdHoc, kMesh, kAccessPoint, kMonitor, kOcb };

/// "client of an access point", "ad hoc", ...: for people.
const char* name_of(Mode mode);
/// "managed", "ibss", "mesh", "ap", "monitor", "ocb", "other": as `iw` and options have it.
const char* word_of(Mode mode);

struct Interface {
  Mode mode = Mode::kOther;
  std::string network;  // SSID or mesh id; empty: none
  std::optional<std::uint32_t> frequency_mhz;
  std::uint32_t wiphy = 0;
};

/// A robot, or the access point, that the radio exchanges frames with directly.
struct Station {
  std::uint64_t address = 0;      // MAC
  std::optional<int> signal_dbm;  // average where the driver keeps one, else of the last frame
  std::optional<std::uint32_t> beacon_interval_tu;  // of a station's access point; 1 TU = 1024 us
  std::optional<std::uint32_t> dtim_period;         // beacons from one group delivery to the next
};

/// The network that the interface is in, from its beacons.
struct Network {
  std::uint64_t bssid = 0;
  std::string name;
  std::optional<std::uint32_t> frequency_mhz;
  std::optional<std::uint32_t> beacon_interval_tu;
  std::vector<double> basic_rates_mbps;  // without those of 802.11n and newer
  std::string country;                   // "DE"; empty: the beacons do not tell
};

/// Each: none if the kernel refuses, or knows of no such thing. @param interface  its index
std::optional<Interface> interface_of(Asker& asker, unsigned interface);
std::optional<std::vector<Station>> stations_of(Asker& asker, unsigned interface);
std::optional<Network> network_of(Asker& asker, unsigned interface);
std::optional<bool> has_power_save(Asker& asker, unsigned interface);
/// Two letters; "00": no country is set, the world's smallest common rights.
std::optional<std::string> country_of(Asker& asker, std::uint32_t wiphy);

/// 1 for 2412, 36 for 5180; 0: not a channel of these bands.
int channel_of(std::uint32_t frequency_mhz);

/// Each changes something, with the caller's rights. @return errno; 0: done
int switch_power_save_off(Asker& asker, unsigned interface);
/// @param country  two letters
int request_country(Asker& asker, const std::string& country);
/// Of an ad hoc or mesh interface, in the band that it is in.
int set_multicast_rate(Asker& asker, unsigned interface, std::uint32_t rate_100kbps);

}  // namespace swarmtalk::nl80211
