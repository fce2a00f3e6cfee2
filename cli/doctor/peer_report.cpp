#include "cli/doctor/peer.hpp"

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

}  // namespace swarmtalk::cli::doctor
