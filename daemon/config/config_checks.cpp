#include "daemon/config/config_checks.hpp"

#include <string>

namespace swarmtalk::daemon {

void check_paths(const KeyLines& lines, const Config& config) {
  const std::string& socket = config.socket.path;
  const std::string the_socket = lines.is_option("socket.path") ? "--socket" : "socket.path";
  const auto fail = [&](const char* key, const std::string& other) {
    throw lines.error(key, "is the path of " + other + " too; give each a path of its own");
  };
  const auto is_taken = [&](const std::string& path) {
    return path == socket || path == socket + ".lock";
  };
  if (is_taken(config.node.pose_socket)) fail("node.pose_socket", the_socket);
  if (config.metrics.file.empty()) return;
  if (is_taken(config.metrics.file)) fail("metrics.file", the_socket);
  if (config.metrics.file == config.node.pose_socket) fail("metrics.file", "node.pose_socket");
}

void check_effects(const KeyLines& lines, const Config& config, NodeIdRule rule_of_file) {
  const auto is_given = [&](const char* key) { return lines.values().contains(key); };
  const auto is_rule = [&](NodeIdRule rule) {
    return rule_of_file == rule || config.node.id_rule == rule;
  };
  const bool finds_address = is_rule(NodeIdRule::kAddress);
  if (is_given("node.id_offset") && !finds_address && !is_rule(NodeIdRule::kHostname)) {
    throw lines.error("node.id_offset",
                      "means nothing unless node.id is \"hostname\" or \"ip\"; leave it out, or "
                      "let node.id be one of them");
  }
  if (is_given("node.id_interface") && !finds_address) {
    throw lines.error(
        "node.id_interface",
        "means nothing unless node.id is \"ip\"; leave it out, or let node.id be that");
  }
  if (is_given("metrics.interval_s") && config.metrics.file.empty()) {
    throw lines.error("metrics.interval_s",
                      "means nothing without metrics.file; leave it out, or add that");
  }
}

}  // namespace swarmtalk::daemon
