#include "cli/doctor/peer.hpp"
#include "text/encoding.hpp"

namespace swarmtalk::cli::doctor {

std::optional<PeerReport> read_report(const nlohmann::ordered_json& json, std::uint32_t own_node) {
  if (!json.is_object() || !json.contains("robot") || !json["robot"].is_object()) {
    return std::nullopt;
  }
  if (!json.contains("links") || !json["links"].is_array()) return std::nullopt;
  PeerReport report;
  const auto text = [](const auto& from, const char* key) {
    return from.contains(key) && from[key].is_string() ? from[key].template get<std::string>()
                                                       : std::string();
  };
  const auto number = [](const auto& from, const char* key) {
    return from.contains(key) && from[key].is_number_unsigned()
               ? from[key].template get<std::uint32_t>()
               : 0U;
  };
  report.version = text(json["robot"], "version");
  for (const auto& link : json["links"]) {
    if (!link.is_object()) return std::nullopt;
    if (report.ethertype == 0) report.ethertype = number(link, "ethertype");
    if (report.mtu_bytes == 0 && text(link, "type") == "raw_l2") {
      report.mtu_bytes = number(link, "interface_mtu_bytes");
    }
    if (report.mode.empty() && link.contains("radio") && link["radio"].is_object()) {
      report.mode = text(link["radio"], "mode");
      report.network = text(link["radio"], "network");
      report.bssid = text(link["radio"], "bssid");
      report.frequency_mhz = number(link["radio"], "frequency_mhz");
    }
    if (!link.contains("hears") || !link["hears"].is_array()) continue;
    for (const auto& node : link["hears"]) {
      report.hears_us = report.hears_us || (node.is_number_unsigned() && node == own_node);
    }
  }
  return report;
}

std::optional<PeerReport> read_report(std::string_view text, std::uint32_t own_node,
                                      std::string& problem) {
  problem = text::encoding_problem(text);  // as the shell of Windows writes it
  if (!problem.empty()) return std::nullopt;
  const auto json = nlohmann::ordered_json::parse(text, nullptr, false);
  auto report = json.is_discarded() ? std::nullopt : read_report(json, own_node);
  if (!report) problem = "is not what `swarmtalk-cli doctor --json` prints";
  return report;
}

}  // namespace swarmtalk::cli::doctor
