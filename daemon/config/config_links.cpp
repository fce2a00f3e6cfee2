#include "daemon/config/config_links.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "daemon/common/names.hpp"
#include "daemon/config/config_checks.hpp"
#include "daemon/config/kilobot_config.hpp"
#include "daemon/config/node_id_rule.hpp"
#include "daemon/config/profiles.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kMaxInterfaceBytes = 15;  // IFNAMSIZ less the zero

void read_pacing(const TableReader& table, LinkConfig& link) {
  table.read_number("rate_hz", 0.0, kMaxRateHz, link.rate_hz);
  table.read_integer("burst_frames", kBurstLimits, link.burst_frames);
  table.read_integer("jitter_us", kJitterUsLimits, link.jitter_us);
  if (table.has("forward_jitter_us")) {
    table.read_integer("forward_jitter_us", kJitterUsLimits, link.forward_jitter_us.emplace());
  }
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

void read_key_path(const TableReader& table, const char* key, std::string& path) {
  if (!table.has(key)) return;
  table.read_text(key, path);
  if (path.empty() || path.front() != '/') {
    table.fail(key, "is not an absolute path; begin it with '/'");
  }
}

void read_keys(const TableReader& table, LinkConfig& link) {
  read_key_path(table, "key_file", link.key_file);
  read_key_path(table, "also_key_file", link.also_key_file);
  table.read_bool("check_freshness", link.checks_freshness);
  for (const char* key : {"also_key_file", "check_freshness"}) {
    if (table.has(key) && link.key_file.empty()) {
      table.fail(key, "means nothing without a key_file; add that");
    }
  }
}

void read_virtual_range(const TableReader& table, VirtualRange& range) {
  table.read_number("virtual_range_m", 0.0, kMaxVirtualRangeM, range.limit_m);
  range.drops_unknown = table.read_choice("virtual_range_unknown", {"deliver", "drop"}) == 1;
  if (table.has("virtual_range_unknown") && range.limit_m == 0.0) {
    table.fail("virtual_range_unknown", "means nothing without a virtual_range_m; add that");
  }
}

void read_forwarding(const TableReader& table, Forwarding& forwarding) {
  table.read_bool("forward", forwarding.is_on);
  table.read_integer("max_forward_ttl", kForwardTtlLimits, forwarding.max_ttl);
  table.read_integer("max_forward_wait_ms", kForwardWaitMsLimits, forwarding.max_wait_ms);
  for (const char* key : {"max_forward_ttl", "max_forward_wait_ms"}) {
    if (!forwarding.is_on && table.has(key)) {
      table.fail(key, "means nothing with forward = false; leave one of them out");
    }
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

using Keys = std::vector<std::string>;

// What each link with a node takes, what each type adds, what concerns its frames, and what
// concerns a shared medium.
Keys node_keys() {
  return {"type", "profile", "node_id"};
}
Keys frame_keys() {
  return {"key_file", "also_key_file", "virtual_range_m", "virtual_range_unknown",
          "ghosts",   "forward",       "max_forward_ttl", "max_forward_wait_ms"};
}
Keys air_keys() {
  return {"check_freshness",   "rate_hz",   "burst_frames",  "jitter_us",
          "forward_jitter_us", "beacon_ms", "air_rate_mbps", "receive_buffer_bytes"};
}
Keys raw_keys() {
  return {"interface", "ethertype"};
}
Keys udp_keys() {
  return {"interface", "address", "port"};
}
Keys replay_keys() {
  return {"file", "output", "pace", "ethertype"};
}

Keys joined(std::initializer_list<Keys> parts) {
  Keys all;
  for (const Keys& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

LinkConfig read_link(const TableReader& table, const std::string& name) {
  LinkConfig link;
  link.name = name;
  const int type = table.read_choice("type", {"raw_l2", "udp", "replay", "kilobot"});
  if (type < 0) {
    const Keys keys =
        joined({kilobot_keys(), raw_keys(), udp_keys(), replay_keys(), frame_keys(), air_keys()});
    table.expect_keys(keys);
    table.fail_missing("type", "add type = \"raw_l2\", \"udp\", \"replay\" or \"kilobot\"");
  }
  link.type = static_cast<LinkType>(type);
  switch (link.type) {
    case LinkType::kRawL2:
      table.expect_keys(joined({node_keys(), raw_keys(), frame_keys(), air_keys()}));
      read_interface(table, link);
      if (link.interface.empty()) {
        table.fail_missing("interface", "add interface = \"wlan0\" (`ip link` lists them)");
      }
      read_ethertype(table, link);
      read_pacing(table, link);
      break;
    case LinkType::kUdp:
      table.expect_keys(joined({node_keys(), udp_keys(), frame_keys(), air_keys()}));
      read_interface(table, link);
      read_address(table, link);
      table.read_integer("port", kPortLimits, link.port);
      read_pacing(table, link);
      break;
    case LinkType::kReplay:
      table.expect_keys(joined({node_keys(), replay_keys(), frame_keys()}));
      table.read_text("file", link.file);
      if (link.file.empty()) table.fail_missing("file", "add file = \"capture.pcap\"");
      table.read_text("output", link.output);
      read_ethertype(table, link);
      link.is_fastest = table.read_choice("pace", {"recorded", "fastest"}) == 1;
      break;
    case LinkType::kKilobot:
      link.forwarding.max_wait_ms = 0;  // infrared is slow, and its TTL has 4 bits
      read_kilobot(table, link.kilobot, link.profile);
      break;
  }
  read_profile(table, link);
  read_keys(table, link);
  read_virtual_range(table, link.virtual_range);
  link.hears_ghosts = table.read_choice("ghosts", {"hear", "ignore"}) != 1;
  read_forwarding(table, link.forwarding);
  return link;
}

}  // namespace

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

}  // namespace swarmtalk::daemon
