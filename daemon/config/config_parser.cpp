#include "daemon/config/config_parser.hpp"

#include <arpa/inet.h>
#include <sys/un.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>

#include "daemon/common/logging.hpp"
#include "daemon/common/names.hpp"
#include "daemon/config/config_checks.hpp"
#include "daemon/config/config_gateways.hpp"
#include "daemon/config/kilobot_config.hpp"
#include "daemon/config/node_id_rule.hpp"
#include "daemon/config/profiles.hpp"
#include "daemon/config/table_reader.hpp"
#include "daemon/config/toml_text.hpp"
#include "ipc/byte_ring.hpp"
#include "ipc/framing.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxSocketPathBytes = sizeof(sockaddr_un::sun_path) - 1;
constexpr std::size_t kMaxInterfaceBytes = 15;  // IFNAMSIZ less the zero
constexpr std::size_t kMaxChannelNames = 1024;

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
  table.expect_keys({"id", "id_offset", "id_interface", "pose", "pose_socket", "pose_max_age_ms"});
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

void read_pacing(const TableReader& table, LinkConfig& link) {
  table.read_number("rate_hz", 0.0, kMaxRateHz, link.rate_hz);
  table.read_integer("burst_frames", kBurstLimits, link.burst_frames);
  table.read_integer("jitter_us", kJitterUsLimits, link.jitter_us);
  table.read_number("air_rate_mbps", 0.0, kMaxAirRateMbps, link.air_rate_mbps);
  table.read_integer("beacon_ms", kBeaconMsLimits, link.beacon_ms);
  if (link.beacon_ms != 0 && link.beacon_ms < kLeastBeaconMs) {
    table.fail("beacon_ms", std::to_string(link.beacon_ms) +
                                " would fill the air; use 20 or more, or 0 for none");
  }
  if (table.has("receive_buffer_bytes")) {
    table.read_integer("receive_buffer_bytes", kReceiveBufferLimits,
                       link.receive_buffer_bytes.emplace());
  }
}

void read_interface(const TableReader& table, LinkConfig& link) {
  table.read_text("interface", link.interface);
  if (link.interface.size() > kMaxInterfaceBytes) {
    table.fail("interface", "is longer than an interface's name can be (15 bytes)");
  }
}

/// IPv4, ARP, VLAN, IPv6, EAPOL: every machine around would take our frames for its own.
void read_ethertype(const TableReader& table, LinkConfig& link) {
  table.read_integer("ethertype", kEthertypeLimits, link.ethertype);
  for (const int used : {0x0800, 0x0806, 0x8100, 0x86DD, 0x888E}) {
    if (link.ethertype == used) {
      table.fail("ethertype",
                 "is that of the network itself (IP, ARP, VLAN or EAPOL); use one for "
                 "experiments, 0x88B5 or 0x88B6");
    }
  }
}

void read_address(const TableReader& table, LinkConfig& link) {
  if (!table.has("address")) return;
  table.read_text("address", link.address);
  in_addr address{};
  const bool is_address = inet_pton(AF_INET, link.address.c_str(), &address) == 1;
  if (is_address && address.s_addr != INADDR_ANY) return;
  table.fail("address", "\"" + printable(link.address) +
                            "\" is not an address to send to; use a multicast group such as "
                            "239.255.83.84, or a broadcast address such as 192.168.1.255");
}

void read_key_file(const TableReader& table, LinkConfig& link) {
  if (!table.has("key_file")) return;
  table.read_text("key_file", link.key_file);
  if (link.key_file.empty() || link.key_file.front() != '/') {
    table.fail("key_file", "is not an absolute path; begin it with '/'");
  }
}

void read_virtual_range(const TableReader& table, VirtualRange& range) {
  table.read_number("virtual_range_m", 0.0, kMaxVirtualRangeM, range.limit_m);
  range.drops_unknown = table.read_choice("virtual_range_unknown", {"deliver", "drop"}) == 1;
  if (table.has("virtual_range_unknown") && range.limit_m == 0.0) {
    table.fail("virtual_range_unknown", "means nothing without a virtual_range_m; add that");
  }
}

void read_profile(const TableReader& table, LinkConfig& link) {
  std::vector<const char*> names;
  for (const ProfileEntry& entry : kProfiles) names.push_back(entry.name.text);
  const int profile = table.read_choice("profile", names);
  if (profile >= 0) link.profile = kProfiles[profile].name.id;
  if (!table.has("node_id")) return;
  const ProfileEntry& entry = profile_entry(link.profile);
  std::uint16_t id = 0;
  table.read_integer("node_id", {1, entry.limits.max_node_id}, id);
  link.node_id = id;
}

LinkConfig read_link(const TableReader& table, const std::string& name) {
  LinkConfig link;
  link.name = name;
  const int type = table.read_choice("type", {"raw_l2", "udp", "replay", "kilobot"});
  if (type < 0) {
    std::vector<std::string> keys = kilobot_keys();
    keys.insert(keys.end(),
                {"interface", "ethertype", "address", "port", "file", "output", "pace", "key_file",
                 "virtual_range_m", "virtual_range_unknown", "rate_hz", "burst_frames", "jitter_us",
                 "beacon_ms", "air_rate_mbps", "receive_buffer_bytes"});
    table.expect_keys(keys);
    table.fail_missing("type", "add type = \"raw_l2\", \"udp\", \"replay\" or \"kilobot\"");
  }
  link.type = static_cast<LinkType>(type);
  switch (link.type) {
    case LinkType::kRawL2:
      table.expect_keys({"type", "profile", "node_id", "interface", "ethertype", "key_file",
                         "virtual_range_m", "virtual_range_unknown", "rate_hz", "burst_frames",
                         "jitter_us", "beacon_ms", "air_rate_mbps", "receive_buffer_bytes"});
      read_interface(table, link);
      if (link.interface.empty()) {
        table.fail_missing("interface", "add interface = \"wlan0\" (`ip link` lists them)");
      }
      read_ethertype(table, link);
      read_pacing(table, link);
      break;
    case LinkType::kUdp:
      table.expect_keys({"type", "profile", "node_id", "interface", "address", "port", "key_file",
                         "virtual_range_m", "virtual_range_unknown", "rate_hz", "burst_frames",
                         "jitter_us", "beacon_ms", "air_rate_mbps", "receive_buffer_bytes"});
      read_interface(table, link);
      read_address(table, link);
      table.read_integer("port", kPortLimits, link.port);
      read_pacing(table, link);
      break;
    case LinkType::kReplay:
      table.expect_keys({"type", "profile", "node_id", "file", "output", "pace", "ethertype",
                         "key_file", "virtual_range_m", "virtual_range_unknown"});
      table.read_text("file", link.file);
      if (link.file.empty()) table.fail_missing("file", "add file = \"capture.pcap\"");
      table.read_text("output", link.output);
      read_ethertype(table, link);
      link.is_fastest = table.read_choice("pace", {"recorded", "fastest"}) == 1;
      break;
    case LinkType::kKilobot:
      read_kilobot(table, link.kilobot, link.profile);
      break;
  }
  read_profile(table, link);
  read_key_file(table, link);
  read_virtual_range(table, link.virtual_range);
  return link;
}

void read_links(const TableReader& root, KeyLines& lines, std::vector<LinkConfig>& links) {
  const toml::table& table = root.table("links");
  const TableReader reader(table, "links", lines);
  if (table.empty()) {
    throw ConfigError(lines.file() +
                      ": no [links.NAME] section, so there is nothing to send on; add one, such as "
                      "[links.wifi] with type = \"raw_l2\" and interface = \"wlan0\"");
  }
  std::vector<std::pair<unsigned, LinkConfig>> in_file_order;
  for (const auto& [key, node] : table) {
    const std::string name(key.str());
    if (!is_legal_name(name)) {
      reader.fail(name, "is not a name for a link; use 1 to 64 printable characters");
    }
    if (!node.is_table()) {
      reader.fail_type(name, "a section: each link has its own, such as [links.wifi]");
    }
    const TableReader link(reader.table(name), "links." + name, lines);
    in_file_order.emplace_back(key.source().begin.line, read_link(link, name));
  }
  if (in_file_order.size() > kMaxLinks) {
    throw lines.error("links", "has " + std::to_string(in_file_order.size()) + " links; at most " +
                                   std::to_string(kMaxLinks) + " are possible");
  }
  std::stable_sort(in_file_order.begin(), in_file_order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (auto& [line, link] : in_file_order) links.push_back(std::move(link));
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

void read_ring_bytes(const TableReader& table, LimitsConfig& limits) {
  table.read_integer("ring_bytes", {0, ipc::kRingMostBytes}, limits.ring_bytes);
  if (limits.ring_bytes == 0) return;
  if (std::has_single_bit(limits.ring_bytes) && limits.ring_bytes >= ipc::kRingLeastBytes) return;
  table.fail("ring_bytes", "is " + std::to_string(limits.ring_bytes) +
                               "; it must be 0 (none) or a power of two from " +
                               std::to_string(ipc::kRingLeastBytes) + " to " +
                               std::to_string(ipc::kRingMostBytes));
}

void read_limits(const TableReader& table, LimitsConfig& limits) {
  table.expect_keys({"clients", "subscriptions_per_client", "publishers_per_client",
                     "queue_messages", "queue_messages_max", "queue_bytes", "reply_bytes",
                     "socket_buffer_bytes", "ring_bytes", "waiting_messages", "publish_queue_max",
                     "publish_rate_hz", "publish_burst", "copies_max", "copy_interval_ms",
                     "tracked_senders"});
  table.read_integer("clients", {1, 1000}, limits.clients);
  table.read_integer("subscriptions_per_client", {1, 10'000}, limits.subscriptions_per_client);
  table.read_integer("publishers_per_client", {1, 10'000}, limits.publishers_per_client);
  table.read_integer("queue_messages_max", {1, 100'000}, limits.queue_messages_max);
  limits.queue_messages = std::min(limits.queue_messages, limits.queue_messages_max);
  table.read_integer("queue_messages", {1, limits.queue_messages_max}, limits.queue_messages);
  table.read_integer("queue_bytes", {64 << 10, 1 << 30}, limits.queue_bytes);
  table.read_integer("reply_bytes", {64 << 10, 64 << 20}, limits.reply_bytes);
  table.read_integer("socket_buffer_bytes", {4096, 16 << 20}, limits.socket_buffer_bytes);
  read_ring_bytes(table, limits);
  table.read_integer("waiting_messages", {1, 100'000}, limits.waiting_messages);
  table.read_integer("publish_queue_max", {0, 100'000}, limits.publish_queue_max);
  table.read_integer("publish_rate_hz", {0, 1'000'000}, limits.publish_rate_hz);
  table.read_integer("publish_burst", {1, 1'000'000}, limits.publish_burst);
  table.read_integer("copies_max", {1, 100}, limits.copies_max);
  table.read_integer("copy_interval_ms", {1, 10'000}, limits.copy_interval_ms);
  table.read_integer("tracked_senders", {1, 1'000'000}, limits.tracked_senders);
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
  table.expect_keys({"debug", "harvest", "rate_hz", "burst"});
  table.read_bool("debug", reserved.debug);
  table.read_bool("harvest", reserved.harvest);
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
  if (const StrayCharacter stray = find_stray_character(text); stray.line != 0) {
    throw ConfigError(file + ":" + std::to_string(stray.line) + ": not TOML: " + stray.what);
  }
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    std::string what(error.description());
    what = printable(what.substr(0, what.find('\n')), 160);
    throw ConfigError(file + ":" + std::to_string(error.source().begin.line) + ": not TOML: " +
                      what + "; put text in double quotes, and see https://toml.io for the format");
  } catch (const std::logic_error&) {  // an assertion of the parser
    throw ConfigError(file + ": not TOML; see https://toml.io for the format");
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
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::string text;
  if (stream) {
    text.resize(kMaxFileBytes + 1);
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
  }
  if (!stream.is_open() || stream.bad() || (errno == EISDIR && text.empty())) {
    throw ConfigError(file + ": cannot be read: " + std::strerror(errno) +
                      "; name a readable file with --config FILE");
  }
  if (text.size() > kMaxFileBytes) {
    throw ConfigError(file + ": is larger than 1 MiB; this is not a configuration file");
  }
  return parse_config(text, file, options);
}

}  // namespace swarmtalk::daemon
