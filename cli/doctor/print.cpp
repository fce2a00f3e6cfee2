#include "cli/doctor/print.hpp"

#include <algorithm>

#include "cli/doctor/diagnose.hpp"
#include "text/counted.hpp"

namespace swarmtalk::cli::doctor {
namespace {

constexpr const char* kIndent = "    ";

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json text_or_null(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json radio_json(const RadioFacts& radio) {
  const auto& network = radio.network;
  std::optional<int> signal;
  if (radio.stations) {
    for (const auto& each : *radio.stations) {
      if (each.signal_dbm && (!signal || *each.signal_dbm > *signal)) signal = each.signal_dbm;
    }
  }
  auto frequency = radio.interface.frequency_mhz;
  if (!frequency && network) frequency = network->frequency_mhz;
  std::string name = radio.interface.network;
  if (name.empty() && network) name = network->name;
  return {{"mode", nl80211::word_of(radio.interface.mode)},
          {"network", text_or_null(name)},
          {"bssid", network ? Json(address_text(network->bssid)) : Json(nullptr)},
          {"frequency_mhz", or_null(frequency)},
          {"channel", frequency ? Json(nl80211::channel_of(*frequency)) : Json(nullptr)},
          {"strongest_dbm", or_null(signal)},
          {"power_save", or_null(radio.power_save)},
          {"basic_rates_mbps", network ? Json(network->basic_rates_mbps) : Json::array()},
          {"country", or_null(radio.country)}};
}

Json link_json(const LinkFacts& link, const Facts& facts) {
  Json hears = Json::array();
  for (const NeighbourFacts& each : facts.daemon.neighbours) {
    if (each.link == link.name) hears.push_back(each.node_id);
  }
  Json radio = nullptr;
  Json mtu = nullptr;
  for (const InterfaceFacts& each : facts.interfaces) {
    if (each.name != link.interface || each.index == 0) continue;
    mtu = each.mtu_bytes;
    if (each.radio) radio = radio_json(*each.radio);
  }
  return {{"name", link.name},
          {"type", link.type},
          {"interface", text_or_null(link.interface)},
          {"interface_mtu_bytes", mtu},
          {"up", link.is_up},
          {"ethertype", link.ethertype == 0 ? Json(nullptr) : Json(link.ethertype)},
          {"sealed", link.is_sealed},
          {"hears", hears},
          {"radio", radio}};
}

Json peer_json(const PeerFacts& peer) {
  Json middle = nullptr;
  if (!peer.round_trips_ms.empty()) {
    std::vector<double> sorted = peer.round_trips_ms;
    std::sort(sorted.begin(), sorted.end());
    middle = number(static_cast<float>(sorted[sorted.size() / 2]));
  }
  return {{"robot", peer.robot},
          {"asked", peer.asked},
          {"heard_there", peer.heard_there},
          {"answered", peer.answered},
          {"round_trip_ms", middle},
          {"frames", peer.frames},
          {"signal_dbm", or_null(peer.signal_dbm)},
          {"reached_by_ip", or_null(peer.is_reached)}};
}

/// What is wrong in one line, what to do below it.
std::string lines_of(const Finding& finding, const Look& look) {
  const std::string head = std::string(name_of(finding.severity)) + ": ";
  return (finding.severity == Severity::kNote ? head : look.warning(head)) + finding.subject +
         ": " + finding.what + " [" + finding.id + "]\n" + kIndent + finding.remedy + "\n";
}

std::string result_of(const Report& report) {
  const auto number_of = [&](Severity severity) {
    return std::count_if(report.findings.begin(), report.findings.end(),
                         [&](const Finding& each) { return each.severity == severity; });
  };
  std::string result;
  for (const Severity severity : {Severity::kError, Severity::kWarning}) {
    const auto number = static_cast<std::uint64_t>(number_of(severity));
    if (number == 0) continue;
    result += (result.empty() ? "" : ", ") + text::counted(number, name_of(severity));
  }
  if (!result.empty()) return result;
  return report.not_looked_at.empty() ? "all is well"
                                      : "no finding, but not everything could be looked at";
}

}  // namespace

std::string to_text(const Report& report, const std::vector<Fixed>& fixes, const Look& look) {
  std::string text = result_of(report) + "\n\n";
  for (const Severity severity : {Severity::kError, Severity::kWarning, Severity::kNote}) {
    for (const Finding& each : report.findings) {
      if (each.severity == severity) text += lines_of(each, look);
    }
  }
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const Finding& finding = report.findings[i];
    if (!fixes[i].is_tried) continue;
    text += fixes[i].failure.empty() ? "fixed: " + finding.fix_text + "\n"
                                     : "not fixed: " + finding.subject + " [" + finding.id + "]\n" +
                                           kIndent + fixes[i].failure + "\n";
  }
  for (const NotLooked& each : report.not_looked_at) {
    text += "not looked at: " + each.what + "\n" + kIndent + each.why + "\n";
  }
  if (!report.has_findings()) {
    for (const std::string& each : report.looked_at) text += "ok: " + each + "\n";
  } else {
    std::string looked;
    for (const std::string& each : report.looked_at) looked += (looked.empty() ? "" : ", ") + each;
    text += "looked at: " + (looked.empty() ? std::string("nothing") : looked) + "\n";
  }
  return folded(text, look);
}

Json to_json(const Report& report, const std::vector<Fixed>& fixes, const Facts& facts,
             const PeerFacts* peer) {
  Json findings = Json::array();
  for (std::size_t i = 0; i < report.findings.size(); ++i) {
    const Finding& each = report.findings[i];
    const bool is_tried = i < fixes.size() && fixes[i].is_tried;
    findings.push_back(
        {{"id", each.id},
         {"severity", name_of(each.severity)},
         {"subject", each.subject},
         {"what", each.what},
         {"remedy", each.remedy},
         {"fixed", is_tried ? Json(fixes[i].failure.empty()) : Json(nullptr)},
         {"not_fixed_because", is_tried ? text_or_null(fixes[i].failure) : Json(nullptr)}});
  }
  Json not_looked_at = Json::array();
  for (const NotLooked& each : report.not_looked_at) {
    not_looked_at.push_back({{"what", each.what}, {"why", each.why}});
  }
  Json links = Json::array();
  for (const LinkFacts& each : facts.daemon.links) links.push_back(link_json(each, facts));
  const bool has_daemon = facts.daemon.state == DaemonFacts::State::kRuns;
  return {{"healthy", !report.has_findings()},
          {"findings", findings},
          {"looked_at", report.looked_at},
          {"not_looked_at", not_looked_at},
          {"cli_version", facts.cli_version},
          {"robot",
           {{"node_id", has_daemon ? Json(facts.daemon.node_id) : Json(nullptr)},
            {"version", has_daemon ? Json(facts.daemon.version) : Json(nullptr)}}},
          {"links", links},
          {"peer", peer == nullptr ? Json(nullptr) : peer_json(*peer)}};
}

}  // namespace swarmtalk::cli::doctor
