#include "daemon/config/config_parser.hpp"

#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "daemon/common/logging.hpp"
#include "daemon/common/names.hpp"
#include "daemon/config/config_checks.hpp"
#include "daemon/config/config_gateways.hpp"
#include "daemon/config/config_limits.hpp"
#include "daemon/config/config_links.hpp"
#include "daemon/config/file_access.hpp"
#include "daemon/config/node_id_rule.hpp"
#include "daemon/config/table_reader.hpp"
#include "ipc/framing.hpp"
#include "text/plain.hpp"
#include "text/toml_text.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxSocketPathBytes = sizeof(sockaddr_un::sun_path) - 1;
constexpr std::size_t kMaxChannelNames = 1024;
constexpr std::size_t kMaxNodeNameBytes = 20;

void read_node_id(const TableReader& table, NodeConfig& node) {
  table.read_integer("id_offset", kNodeIdOffsetLimits, node.id_offset);
  table.read_text("id_interface", node.id_interface);
  if (!table.has("id")) return;
  if (table.node("id").is_integer()) {
    std::uint16_t id = 0;
    table.read_integer("id", kNodeIdLimits, id);
    node.id_rule = NodeIdRule::kNumber;
    node.id = id;
    return;
  }
  if (!table.node("id").is_string()) {
    table.fail_type("id", "\"auto\", \"hostname\", \"ip\" or 1 to 65534");
  }
  std::string text;
  table.read_text("id", text);
  const std::string problem = read_node_id_rule(text, node);
  if (!problem.empty()) table.fail("id", problem);
}

void read_node(const TableReader& table, NodeConfig& node) {
  table.expect_keys(
      {"id", "id_offset", "id_interface", "name", "pose", "pose_socket", "pose_max_age_ms"});
  read_node_id(table, node);
  if (table.has("pose")) {
    const auto numbers = table.read_numbers("pose", 3, "[x_m, y_m, theta_rad]");
    if (std::abs(numbers[0]) > kMaxPoseM || std::abs(numbers[1]) > kMaxPoseM) {
      table.fail("pose", "is outside the field; x and y are in metres, -32.767 to 32.767");
    }
    if (std::abs(numbers[2]) > 2 * std::numbers::pi) {
      table.fail("pose",
                 "has more than a whole turn as theta, which is in radians: 90 degrees are 1.5708");
    }
    node.pose = FixedPose{numbers[0], numbers[1], numbers[2]};
  }
  if (table.has("pose_socket")) {
    table.read_text("pose_socket", node.pose_socket);
    const auto problem = socket_path_problem(node.pose_socket);
    if (!problem.empty()) table.fail("pose_socket", problem);
  }
  if (table.has("name")) {
    table.read_text("name", node.name);
    if (node.name.empty() || node.name.size() > kMaxNodeNameBytes) {
      table.fail("name", "has " + std::to_string(node.name.size()) +
                             " bytes; a robot's name has 1 to " +
                             std::to_string(kMaxNodeNameBytes));
    }
    if (!is_legal_name(node.name)) {
      table.fail("name", "has characters that cannot be shown");
    }
  }
  table.read_integer("pose_max_age_ms", kPoseMaxAgeMsLimits, node.pose_max_age_ms);
}

void read_socket(const TableReader& table, SocketConfig& socket) {
  table.expect_keys({"path", "mode", "group"});
  table.read_text("path", socket.path);
  if (const auto problem = socket_path_problem(socket.path); !problem.empty()) {
    table.fail("path", problem);
  }
  std::string mode = "0660";
  table.read_text("mode", mode);
  const bool is_octal = (mode.size() == 3 || (mode.size() == 4 && mode[0] == '0')) &&
                        mode.find_first_not_of("01234567") == std::string::npos;
  if (!is_octal) table.fail("mode", "is not a file mode; write it as \"0660\"");
  socket.mode = static_cast<mode_t>(std::stoul(mode, nullptr, 8));
  table.read_text("group", socket.group);
}

void read_channels(const TableReader& root, KeyLines& lines,
                   std::map<std::string, std::uint16_t>& channels) {
  const toml::table& table = root.table("channels");
  const TableReader reader(table, "channels", lines);
  if (table.size() > kMaxChannelNames) {
    throw lines.error("channels", "has " + std::to_string(table.size()) + " names; at most " +
                                      std::to_string(kMaxChannelNames) + " are possible");
  }
  std::vector<const toml::key*> in_file_order;
  for (const auto& [key, node] : table) in_file_order.push_back(&key);
  std::sort(in_file_order.begin(), in_file_order.end(),
            [](auto* a, auto* b) { return a->source().begin < b->source().begin; });
  std::map<std::uint16_t, std::string> names;
  for (const toml::key* key : in_file_order) {
    const std::string name(key->str());
    if (!is_legal_name(name)) {
      reader.fail(name, "is not a name for a channel; use 1 to 64 printable characters");
    }
    if (name.find_first_not_of("0123456789") == std::string::npos) {
      reader.fail(name, "is a number, and a number means itself; give the channel a name");
    }
    std::uint16_t number = 0;
    reader.read_integer(name, kChannelLimits, number);
    const auto [other, is_new] = names.emplace(number, name);
    if (!is_new) {
      reader.fail(name, std::to_string(number) + " is already the number of '" +
                            printable(other->second) + "'; give each channel its own");
    }
    channels.emplace(name, number);
  }
}

void read_log(const TableReader& table, Config& config) {
  std::vector<std::string> keys{"level"};
  keys.insert(keys.end(), kSubsystems.begin(), kSubsystems.end());
  table.expect_keys(keys);
  for (const std::string& key : keys) {
    if (!table.has(key)) continue;
    table.read_choice(key, kLogLevels);
    table.read_text(key, key == "level" ? config.log_level : config.log_levels[key]);
  }
}

void read_metrics(const TableReader& table, MetricsConfig& metrics) {
  table.expect_keys({"file", "interval_s"});
  table.read_text("file", metrics.file);
  if (!metrics.file.empty() && metrics.file.front() != '/') {
    table.fail("file", "is not an absolute path; begin it with '/'");
  }
  table.read_integer("interval_s", kMetricsIntervalSLimits, metrics.interval_s);
}

void read_reserved(const TableReader& table, ReservedConfig& reserved) {
  table.expect_keys({"debug", "harvest", "report", "rate_hz", "burst"});
  table.read_bool("debug", reserved.debug);
  table.read_bool("harvest", reserved.harvest);
  table.read_bool("report", reserved.report);
  table.read_integer("rate_hz", {1, 10'000}, reserved.rate_hz);
  table.read_integer("burst", {1, 10'000}, reserved.burst);
}

void apply(const ConfigOptions& options, ParsedConfig& parsed) {
  if (options.log_level) {
    parsed.config.log_level = *options.log_level;
    parsed.lines.set_option("log.level", "--log-level");
  }
  if (options.node_id) {
    parsed.lines.set_option("node.id", "--node-id");
    const std::string problem = read_node_id_rule(*options.node_id, parsed.config.node);
    if (!problem.empty()) throw parsed.lines.error("node.id", problem);
  }
  if (options.socket_path) {
    parsed.lines.set_option("socket.path", "--socket");
    const std::string problem = socket_path_problem(*options.socket_path);
    if (!problem.empty()) throw parsed.lines.error("socket.path", problem);
    parsed.config.socket.path = *options.socket_path;
  }
}

toml::table parse_toml(std::string_view text, const std::string& file) {
  try {
    return text::parse_toml(text, file);
  } catch (const std::runtime_error& error) {
    throw ConfigError(error.what());
  }
}

}  // namespace

std::string socket_path_problem(const std::string& path) {
  if (path.empty()) return "is empty; give an absolute path";
  if (path.front() != '/') return "is not absolute; begin it with '/'";
  if (path.size() <= kMaxSocketPathBytes) return "";
  return "has " + std::to_string(path.size()) + " bytes, a Unix socket's path at most " +
         std::to_string(kMaxSocketPathBytes) + "; choose a shorter one";
}

std::string how_to_change(const ParsedConfig& parsed) {
  const std::string& socket = parsed.config.socket.path;
  return text::shell_word(parsed.lines.file()) + ", then: swarmtalk-cli " +
         (socket == ipc::kDefaultSocketPath ? "" : "--socket " + text::shell_word(socket) + " ") +
         "reload";
}

ParsedConfig parse_config(std::string_view text, const std::string& file,
                          const ConfigOptions& options) {
  const toml::table table = parse_toml(text, file);
  ParsedConfig parsed{{}, KeyLines(file)};
  parsed.config.socket.path = ipc::kDefaultSocketPath;
  const TableReader root(table, "", parsed.lines);
  root.expect_keys(
      {"node", "socket", "links", "channels", "gateway", "limits", "log", "metrics", "reserved"});
  const auto section = [&](const char* name) {
    return TableReader(root.table(name), name, parsed.lines);
  };
  read_node(section("node"), parsed.config.node);
  read_socket(section("socket"), parsed.config.socket);
  read_channels(root, parsed.lines, parsed.config.channels);
  read_limits(section("limits"), parsed.config.limits);
  read_log(section("log"), parsed.config);
  read_metrics(section("metrics"), parsed.config.metrics);
  read_reserved(section("reserved"), parsed.config.reserved);
  read_links(root, parsed.lines, parsed.config.links);
  read_gateways(root, parsed.lines, parsed.config);
  const NodeIdRule rule_of_file = parsed.config.node.id_rule;
  apply(options, parsed);
  check_channels(root, parsed.lines, parsed.config);
  check_node_ids(parsed.lines, parsed.config);
  check_paths(parsed.lines, parsed.config);
  check_effects(parsed.lines, parsed.config, rule_of_file);
  return parsed;
}

ParsedConfig load_config(const std::string& file, const ConfigOptions& options) {
  if (file.empty()) throw ConfigError("--config: is empty; give the path of a file");
  std::error_code unknown;  // what is no file is told below
  if (std::filesystem::is_fifo(file, unknown) && !file.starts_with("/dev/")) {  // of <(...)
    throw ConfigError(file + ": is a pipe, not a file; name a file, or /dev/stdin");
  }
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::string text;
  if (stream) {
    text.resize(kMaxFileBytes + 1);
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
  }
  if (!stream.is_open() || stream.bad() || (errno == EISDIR && text.empty())) {
    throw ConfigError(file + ": " + unreadable(file, errno, FileKind::kConfiguration));
  }
  if (text.size() > kMaxFileBytes) {
    throw ConfigError(file + ": is larger than 1 MiB; this is not a configuration file");
  }
  return parse_config(text, file, options);
}

}  // namespace swarmtalk::daemon
