#include <algorithm>
#include <cctype>

#include "cli/doctor/diagnose.hpp"

namespace swarmtalk::cli::doctor {
namespace {

using nl80211::Mode;

constexpr std::uint32_t kLowestRateOf24GhzMhz = 2500;  // below: 802.11b's 1 Mb/s is mandatory
constexpr double kLowestOfBand = 1.0;

std::string number_text(double value) {
  const auto tenths = static_cast<long>(value * 10 + 0.5);
  const std::string whole = std::to_string(tenths / 10);
  return tenths % 10 == 0 ? whole : whole + "." + std::to_string(tenths % 10);
}

std::string channel_text(std::uint32_t frequency_mhz) {
  return "channel " + std::to_string(nl80211::channel_of(frequency_mhz)) + " (" +
         std::to_string(frequency_mhz) + " MHz)";
}

std::string network_of(const RadioFacts& radio) {
  if (!radio.interface.network.empty()) return radio.interface.network;
  return radio.network ? radio.network->name : "";
}

std::optional<std::uint32_t> frequency_of(const RadioFacts& radio) {
  if (radio.interface.frequency_mhz) return radio.interface.frequency_mhz;
  return radio.network ? radio.network->frequency_mhz : std::nullopt;
}

bool is_joined(const RadioFacts& radio) {
  switch (radio.interface.mode) {
    case Mode::kStation:
      // The kernel lists the access point as a station once it is associated.
      return radio.network.has_value() || (radio.stations && !radio.stations->empty());
    case Mode::kAdHoc:
      return !radio.interface.network.empty() || radio.network.has_value();
    default:
      return frequency_of(radio).has_value();
  }
}

/// The rate of its broadcasts, as far as it is known: lowest basic rate of the network.
std::optional<double> broadcast_rate(const RadioFacts& radio) {
  if (radio.network && !radio.network->basic_rates_mbps.empty()) {
    const auto& rates = radio.network->basic_rates_mbps;
    return *std::min_element(rates.begin(), rates.end());
  }
  const bool is_own = radio.interface.mode == Mode::kAdHoc || radio.interface.mode == Mode::kMesh;
  const auto frequency = frequency_of(radio);
  if (is_own && frequency && *frequency < kLowestRateOf24GhzMhz) return kLowestOfBand;
  return std::nullopt;
}

void diagnose_rate(const std::string& name, const RadioFacts& radio, const LinkFacts* link,
                   Report& report) {
  const auto lowest = broadcast_rate(radio);
  const Mode mode = radio.interface.mode;
  const bool is_ours = mode == Mode::kAdHoc || mode == Mode::kMesh;
  const double told = link != nullptr ? link->air_rate_mbps : 0;
  if (!lowest) {
    const auto frequency = frequency_of(radio);
    const bool is_low_band = frequency && *frequency < kLowestRateOf24GhzMhz;
    if (is_low_band && mode == Mode::kStation) {
      report.not_looked_at.push_back(
          {"rate of broadcasts on " + name, "the kernel has no beacon of the access point"});
    }
    return;
  }
  // The kernel does not tell a multicast rate that was set; the configuration may.
  const double rate = is_ours && told > 0 ? told : *lowest;
  if (rate >= kLeastBroadcastMbps) {
    report.looked_at.push_back("rate of broadcasts on " + name);
    return;
  }
  const std::string at = number_text(rate) + " Mb/s";
  if (is_ours) {
    report.add({"multicast-rate", Severity::kWarning, name,
                "broadcasts leave at " + at + ", the lowest basic rate, unless another was set",
                "sudo iw dev " + name + " set mcast_rate 6, and air_rate_mbps = 6 for the link"});
    return;
  }
  report.add(
      {"multicast-rate", Severity::kWarning, name,
       "the access point sends broadcasts at " + at + ", its lowest basic rate",
       "take 1, 2, 5.5 and 11 Mb/s out of its basic rates (hostapd: basic_rates=60 120 240), "
       "or use 5 GHz"});
}

void diagnose_country(const std::string& name, const RadioFacts& radio, const Expected& expected,
                      Report& report) {
  if (!radio.country) {
    report.not_looked_at.push_back({"regulatory domain of " + name, "the kernel does not tell"});
    return;
  }
  const std::string& country = *radio.country;
  const std::string announced = radio.network ? radio.network->country : "";
  if (!expected.country.empty() && country != expected.country) {
    report.add({"regulatory-domain", Severity::kWarning, name,
                "the country is " + country + ", not " + expected.country,
                "sudo iw reg set " + expected.country});
  } else if (country == "00") {
    report.add({"regulatory-domain", Severity::kWarning, name,
                "no country is set, so power and channels are limited to what all countries allow",
                "sudo iw reg set CC with your country's two letters, for good: wireless-regdb and "
                "country=CC in the Wi-Fi's configuration"});
  } else if (!announced.empty() && std::isupper(static_cast<unsigned char>(country[0])) != 0 &&
             announced != country) {
    report.add({"regulatory-domain", Severity::kWarning, name,
                "the country is " + country + ", and the access point says " + announced,
                "sudo iw reg set " + announced + ", or correct the access point's country"});
  } else {
    report.looked_at.push_back("regulatory domain of " + name);
  }
}

void diagnose_signal(const std::string& name, const RadioFacts& radio, Report& report) {
  std::optional<int> best;
  if (radio.stations) {
    for (const auto& each : *radio.stations) {
      if (each.signal_dbm && (!best || *each.signal_dbm > *best)) best = each.signal_dbm;
    }
  }
  const bool is_client = radio.interface.mode == Mode::kStation;
  if (!best) {
    if (is_client)
      report.not_looked_at.push_back({"signal on " + name, "the kernel does not tell"});
    return;
  }
  report.looked_at.push_back("signal on " + name);
  if (*best >= kWeakSignalDbm) return;
  const std::string dbm = std::to_string(*best) + " dBm";
  report.add(
      {"signal-low", Severity::kWarning, name,
       is_client ? "the access point is heard at " + dbm : "no robot is heard stronger than " + dbm,
       is_client ? "bring the robot or the access point closer, turn its antenna, or use a "
                   "repeater on the same network"
                 : "bring the robots closer, or look at the antenna"});
}

/// @return whether it explains a link that is down
bool diagnose_mode(const std::string& name, const RadioFacts& radio, const Expected& expected,
                   Report& report) {
  const Mode mode = radio.interface.mode;
  const std::string word = nl80211::word_of(mode);
  const bool is_usable = mode != Mode::kMonitor && mode != Mode::kOther;
  if (!is_usable || (!expected.mode.empty() && word != expected.mode)) {
    const std::string wanted = expected.mode.empty() ? "managed" : expected.mode;
    report.add({"wrong-mode", Severity::kError, name,
                "the radio is in mode " + word +
                    (is_usable ? ", not " + expected.mode : ", in which robots do not hear it"),
                "sudo ip link set " + name + " down; sudo iw dev " + name + " set type " +
                    (wanted == "mesh" ? "mp" : wanted) + "; sudo ip link set " + name +
                    " up; then join the network"});
    return true;
  }
  if (is_joined(radio)) return false;
  const std::string network = expected.network.empty() ? "NETWORK" : expected.network;
  report.add({"not-joined", Severity::kError, name,
              mode == Mode::kStation
                  ? "the radio is not connected to an access point"
                  : std::string("the radio is in mode ") + word + " and has joined no network",
              mode == Mode::kStation
                  ? "look at wpa_supplicant or NetworkManager: nmcli device wifi connect " + network
              : mode == Mode::kMesh
                  ? "sudo iw dev " + name + " mesh join " + network
                  : "sudo iw dev " + name + " ibss join " + network + " FREQUENCY"});
  return true;
}

void diagnose_place(const std::string& name, const RadioFacts& radio, const Expected& expected,
                    Report& report) {
  const std::string network = network_of(radio);
  if (!expected.network.empty()) {
    if (network.empty()) {
      report.not_looked_at.push_back({"network of " + name, "the kernel does not tell a mesh's"});
    } else if (network != expected.network) {
      report.add({"wrong-network", Severity::kError, name,
                  "the radio is in network \"" + network + "\", not \"" + expected.network + "\"",
                  "join the robots' network"});
    }
  }
  const auto frequency = frequency_of(radio);
  if (expected.channel == 0) return;
  if (!frequency) {
    report.not_looked_at.push_back({"channel of " + name, "the kernel does not tell"});
  } else if (nl80211::channel_of(*frequency) != expected.channel) {
    report.add({"wrong-channel", Severity::kError, name,
                "the radio is on " + channel_text(*frequency) + ", not channel " +
                    std::to_string(expected.channel),
                "join the network on the robots' channel"});
  }
}

/// All robots that have heard a frame send it on: at once, they do it in the same instant.
void diagnose_forwarding(const std::string& name, const LinkFacts* link, Report& report) {
  if (link == nullptr || !link->forward_jitter_us) return;
  if (link->packets_forwarded == 0 || *link->forward_jitter_us > 0) {
    report.looked_at.push_back("pause before sending on, on " + name);
    return;
  }
  report.add({"forwards-collide", Severity::kWarning, name,
              "packets of others are sent on at once, by all robots that have heard them, and "
              "collide",
              "take forward_jitter_us = 0 out of [links." + link->name + "], or write 5000"});
}

}  // namespace

bool diagnose_radio(const InterfaceFacts& interface, const LinkFacts* link,
                    const Expected& expected, Report& report) {
  if (!interface.is_radio) return false;
  const std::string& name = interface.name;
  if (!interface.radio) {
    report.not_looked_at.push_back({"radio of " + name, "nl80211 does not answer"});
    return false;
  }
  const RadioFacts& radio = *interface.radio;
  if (diagnose_mode(name, radio, expected, report)) return true;
  report.looked_at.push_back(std::string("mode of ") + name + " (" +
                             nl80211::name_of(radio.interface.mode) + ")");
  diagnose_place(name, radio, expected, report);
  if (radio.power_save.value_or(false)) {
    report.add({"power-save", Severity::kWarning, name,
                "the radio sleeps between beacons and misses or delays broadcasts",
                "sudo iw dev " + name +
                    " set power_save off, for good: wifi.powersave = 2 in "
                    "NetworkManager"});
  } else if (radio.power_save) {
    report.looked_at.push_back("power save of " + name);
  } else if (radio.interface.mode == Mode::kStation) {
    report.not_looked_at.push_back({"power save of " + name, "the driver does not tell"});
  }
  diagnose_rate(name, radio, link, report);
  diagnose_forwarding(name, link, report);
  diagnose_country(name, radio, expected, report);
  diagnose_signal(name, radio, report);
  return false;
}

}  // namespace swarmtalk::cli::doctor
