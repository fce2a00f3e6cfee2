#include <algorithm>
#include <cmath>
#include <numbers>

#include "cli/doctor/diagnose.hpp"
#include "cli/doctor/peer.hpp"
#include "cli/text/numbers.hpp"

namespace swarmtalk::cli::doctor {
namespace {

using nl80211::Mode;

constexpr double kUsualBeaconMs = 102.4;  // 100 TU of 1024 us
constexpr double kMsPerTu = 1.024;
// Resultant length: 1, all at one phase. Answers paced at 100 ms, near a beacon's 102.4 ms, come to
// 0.4 in three seconds, evenly spread ones to 0.1.
constexpr double kLeastTogether = 0.7;
constexpr std::size_t kLeastArrivals = 10;
constexpr double kMostLoss = 0.3;  // of a healthy pair in reach; broadcast is never repeated

std::string percent(double share) {
  return std::to_string(std::lround(100 * share)) + " %";
}

const LinkFacts* link_of(const PeerFacts& peer, const Facts& own) {
  const LinkFacts* found = nullptr;
  for (const LinkFacts& each : own.daemon.links) {
    const bool is_of_frames = each.type == "raw_l2" || each.type == "udp";
    if (each.name == peer.link || (found == nullptr && is_of_frames)) found = &each;
  }
  return found;
}

const RadioFacts* radio_of(const LinkFacts* link, const Facts& own) {
  for (const InterfaceFacts& each : own.interfaces) {
    if (link != nullptr && each.name == link->interface && each.radio) return &*each.radio;
  }
  return nullptr;
}

std::string hex(std::uint32_t ethertype) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text = "0x";
  for (int shift = 12; shift >= 0; shift -= 4) text += kDigits[ethertype >> shift & 0xF];
  return text;
}

/// The interface with the smaller MTU drops longer frames, and nothing tells their sender.
void compare_mtus(const PeerFacts& peer, const LinkFacts* link, const Facts& own, Report& report) {
  if (!peer.report || peer.report->mtu_bytes == 0) return;
  if (link == nullptr || link->type != "raw_l2") return;
  for (const InterfaceFacts& each : own.interfaces) {
    if (each.name != link->interface || each.index == 0) continue;
    const std::size_t theirs = peer.report->mtu_bytes;
    if (std::min(theirs, kUsualMtuBytes) == std::min(each.mtu_bytes, kUsualMtuBytes)) return;
    report.add({"mtu-differs", Severity::kWarning, "robot " + std::to_string(peer.robot),
                "the MTU of its interface is " + std::to_string(theirs) + ", and of this robot's " +
                    std::to_string(each.mtu_bytes) + ": the smaller drops longer frames",
                "sudo ip link set INTERFACE mtu 1500, on the robot that has less"});
  }
}

/// What differs by both robots' own words. @return whether something was found
bool compare(const PeerFacts& peer, const LinkFacts* link, const RadioFacts* radio,
             Report& report) {
  if (!peer.report) return false;
  const PeerReport& other = *peer.report;
  const std::string robot = "robot " + std::to_string(peer.robot);
  if (link != nullptr && link->ethertype != 0 && other.ethertype != 0 &&
      link->ethertype != other.ethertype) {
    report.add(
        {"ethertype-differs", Severity::kError, robot,
         "it uses EtherType " + hex(other.ethertype) + ", and this robot " + hex(link->ethertype),
         "set one `ethertype` on all robots, then restart swarmtalkd"});
    return true;
  }
  if (radio == nullptr || other.mode.empty()) return false;
  const std::string mode = nl80211::word_of(radio->interface.mode);
  const bool are_together = (mode == "managed" && other.mode == "ap") ||
                            (mode == "ap" && other.mode == "managed") || mode == other.mode;
  if (!are_together) {
    report.add({"wrong-mode", Severity::kError, robot,
                "its radio is in mode " + other.mode + ", and this robot's in " + mode,
                "bring all robots into one mode"});
    return true;
  }
  const std::string network = !radio->interface.network.empty() ? radio->interface.network
                              : radio->network                  ? radio->network->name
                                                                : "";
  if (!network.empty() && !other.network.empty() && network != other.network) {
    report.add({"wrong-network", Severity::kError, robot,
                "it is in network \"" + other.network + "\", and this robot in \"" + network + "\"",
                "join one network on all robots"});
    return true;
  }
  // Clients of two access points of one network may be on two channels and hear each other.
  const bool is_direct = mode == "ibss" || mode == "mesh";
  const auto frequency = radio->interface.frequency_mhz;
  if (is_direct && frequency && other.frequency_mhz != 0 && other.frequency_mhz != *frequency) {
    report.add({"wrong-channel", Severity::kError, robot,
                "it is on channel " + std::to_string(nl80211::channel_of(other.frequency_mhz)) +
                    ", and this robot on channel " +
                    std::to_string(nl80211::channel_of(*frequency)),
                "join the network on one channel on all robots"});
    return true;
  }
  if (mode == "ibss" && radio->network && !other.bssid.empty() &&
      other.bssid != address_text(radio->network->bssid)) {
    report.add({"cells-split", Severity::kError, robot,
                "the ad hoc network has split: its cell is " + other.bssid + ", this robot's " +
                    address_text(radio->network->bssid),
                "join with one fixed cell on all robots: iw dev IF ibss join NETWORK FREQUENCY "
                "fixed-freq 02:11:22:33:44:55"});
    return true;
  }
  return false;
}

void diagnose_silence(const PeerFacts& peer, const LinkFacts* link, const RadioFacts* radio,
                      Report& report) {
  const std::string robot = "robot " + std::to_string(peer.robot);
  if (peer.frames > 0 && peer.report && peer.report->hears_us) {
    report.not_looked_at.push_back(
        {robot,
         "both hear each other, and it answers no question: "
         "start `swarmtalk-cli ping --answer` there, or set `report = true`"});
    return;
  }
  if (peer.frames > 0) {
    const std::string counts = ": " + std::to_string(peer.frames) +
                               " frames came, and no answer to " + std::to_string(peer.asked) +
                               " questions";
    if (peer.report) {
      report.add({"one-way", Severity::kError, robot,
                  "it is heard, and does not hear this robot" + counts,
                  "compare antennas and power of the two, and `swarmtalk-cli doctor` there"});
    } else {
      report.add({"peer-silent", Severity::kError, robot,
                  "it is heard, and does not hear this robot or answers nobody" + counts,
                  "start `swarmtalk-cli ping --answer` there; if that runs, compare antennas and "
                  "power of the two, and `swarmtalk-cli doctor` there"});
    }
    return;
  }
  // What it heard may be some seconds old, so what differs now comes first.
  if (compare(peer, link, radio, report)) return;
  if (peer.report && peer.report->hears_us) {
    report.add({"one-way", Severity::kError, robot, "it hears this robot, and is not heard here",
                "compare antennas and power of the two, and look for a firewall on this robot"});
    return;
  }
  if (peer.is_reached && *peer.is_reached && link != nullptr && link->type == "raw_l2") {
    report.add(
        {"ethertype-filtered", Severity::kError, robot,
         "it answers by IP, and frames of EtherType " + hex(link->ethertype) + " do not pass",
         "let the access point or switch pass this EtherType, choose another `ethertype` on "
         "all robots, or use a link of type udp; on the robots look at `nft list ruleset`"});
    return;
  }
  if (peer.is_reached && *peer.is_reached) {
    report.add(
        {"multicast-filtered", Severity::kError, robot,
         "it answers by IP, and datagrams to all do not pass",
         "let the access point or switch pass multicast (IGMP snooping), or set `address` of "
         "the link to the broadcast address on all robots"});
    return;
  }
  if (peer.is_reached) {
    const bool is_client = radio != nullptr && radio->interface.mode == Mode::kStation;
    report.add({"client-isolation", Severity::kError, robot,
                std::string("nothing passes between the two, IP neither: ") +
                    (is_client ? "the access point keeps its clients apart"
                               : "what is between keeps them apart") +
                    ", or the other robot is off",
                "switch client isolation off (hostapd: ap_isolate=0), or use ad hoc or mesh mode; "
                "if the robot is off, switch it on"});
    return;
  }
  report.add({"peer-silent", Severity::kError, robot, "nothing comes from it, and no answer",
              "start `swarmtalk-cli ping --answer` there; with --address its IP address tells a "
              "filter from isolation"});
}

void diagnose_timing(const PeerFacts& peer, const RadioFacts* radio, Report& report) {
  double interval_ms = kUsualBeaconMs;
  std::uint32_t dtim = 1;
  if (radio != nullptr && radio->stations) {
    for (const nl80211::Station& each : *radio->stations) {
      if (each.beacon_interval_tu) interval_ms = *each.beacon_interval_tu * kMsPerTu;
      if (each.dtim_period && *each.dtim_period > 0) dtim = *each.dtim_period;
    }
  }
  if (peer.arrivals_ms.size() < kLeastArrivals) {
    report.not_looked_at.push_back({"delay by DTIM", "too few answers came"});
    return;
  }
  report.looked_at.push_back("delay by DTIM");
  if (!comes_with_beacons(peer.arrivals_ms, interval_ms)) return;
  report.add({"multicast-delayed", Severity::kWarning, "robot " + std::to_string(peer.robot),
              "broadcasts come in bursts, with every beacon or some (" +
                  std::to_string(std::lround(interval_ms)) + " ms), " +
                  std::to_string(std::lround(median(peer.round_trips_ms).value_or(0))) +
                  " ms there and back: the access point holds them while a client sleeps" +
                  (dtim > 1 ? "; its DTIM period is " + std::to_string(dtim) : ""),
              "switch power save off on all clients of the access point (iw dev wlan0 set "
              "power_save off), and set its DTIM period to 1"});
}

}  // namespace

bool comes_with_beacons(const std::vector<double>& arrivals_ms, double interval_ms) {
  if (arrivals_ms.size() < kLeastArrivals || !(interval_ms > 0)) return false;
  double x = 0;
  double y = 0;
  for (const double each : arrivals_ms) {
    const double angle = 2 * std::numbers::pi * std::fmod(each, interval_ms) / interval_ms;
    x += std::cos(angle);
    y += std::sin(angle);
  }
  return std::hypot(x, y) / static_cast<double>(arrivals_ms.size()) >= kLeastTogether;
}

void diagnose_peer(const PeerFacts& peer, const Facts& own, Report& report) {
  const std::string robot = "robot " + std::to_string(peer.robot);
  const LinkFacts* link = link_of(peer, own);
  const RadioFacts* radio = radio_of(link, own);
  const NeighbourFacts* const twin = link == nullptr ? nullptr : double_of(own, *link);
  const bool is_twin = twin != nullptr && twin->node_id == peer.robot;
  report.looked_at.push_back(robot);
  if (peer.frames > 0 && link != nullptr) {  // since the neighbours were asked for
    std::erase_if(report.findings, [&](const Finding& each) {
      return each.id == "nobody-heard" && each.subject == "link " + link->name;
    });
  }
  if (peer.report && !peer.report->version.empty() && peer.report->version != own.daemon.version) {
    report.add(
        {"version-differs", Severity::kWarning, robot,
         "its daemon is version " + peer.report->version + ", this robot's " + own.daemon.version,
         "install one release on all robots"});
  }
  compare_mtus(peer, link, own, report);
  if (peer.answered == 0) {
    // A link that is down, or that both have one hardware address, has been told already.
    if (link != nullptr && link->is_up && !is_twin) diagnose_silence(peer, link, radio, report);
    return;
  }
  const auto share = [](std::uint64_t part, std::uint64_t whole) {
    return whole == 0 ? 0.0
                      : 1 - static_cast<double>(std::min(part, whole)) / static_cast<double>(whole);
  };
  const double there = share(peer.heard_there, peer.asked);
  const double back = share(peer.answered, peer.heard_there);
  const bool is_weak = peer.signal_dbm && *peer.signal_dbm < kWeakSignalDbm;
  if (is_weak) {
    report.add({"signal-low", Severity::kWarning, robot,
                "it is heard at " + std::to_string(*peer.signal_dbm) +
                    " dBm; lost on the way "
                    "there " +
                    percent(there) + ", back " + percent(back),
                "bring the two closer, or look at their antennas"});
  } else if (!is_twin && (there > kMostLoss || back > kMostLoss)) {
    const bool is_lopsided = std::fabs(there - back) > kMostLoss;
    report.add({is_lopsided ? "one-way" : "lossy", Severity::kWarning, robot,
                "lost on the way there " + percent(there) + ", back " + percent(back),
                is_lopsided ? "compare antennas and power of the two"
                            : "bring the two closer, or look who else fills the air: "
                              "swarmtalk-cli top"});
  }
  diagnose_timing(peer, radio, report);
  if (!peer.is_captured) {
    if (link != nullptr && link->type == "raw_l2") {
      report.not_looked_at.push_back({"conversion to unicast", "no frame was captured"});
    }
  } else if (peer.unicast_frames > peer.broadcast_frames) {
    report.add({"unicast-conversion", Severity::kWarning, robot,
                "its broadcasts come as unicast: the access point sends each to every client",
                "switch multicast-to-unicast conversion off (hostapd: multicast_to_unicast=0): "
                "with many robots it fills the air"});
  } else {
    report.looked_at.push_back("conversion to unicast");
  }
}

}  // namespace swarmtalk::cli::doctor
