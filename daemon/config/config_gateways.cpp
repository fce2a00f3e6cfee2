#include "daemon/config/config_gateways.hpp"

#include <algorithm>
#include <charconv>

#include "daemon/common/names.hpp"
#include "daemon/common/printable.hpp"
#include "daemon/config/profiles.hpp"

namespace swarmtalk::daemon {
namespace {

struct End {
  std::size_t link = 0;
  std::uint16_t channel = 0;
};

std::string text_of(std::uint64_t number) {
  return std::to_string(number);
}

std::string profile_text(const LinkConfig& link) {
  const ProfileEntry& entry = profile_entry(link.profile);
  return "link '" + printable(link.name) + "' (profile " + entry.name.text + ")";
}

// The link whose name the text begins with; names may contain a slash.
std::optional<std::size_t> link_of(const std::string& text, const Config& config) {
  for (std::size_t i = 0; i < config.links.size(); ++i) {
    if (text.rfind(config.links[i].name + "/", 0) == 0) return i;
  }
  return std::nullopt;
}

std::uint32_t channel_number(const std::string& text, const Config& config) {
  const bool is_number = text.find_first_not_of("0123456789") == std::string::npos;
  if (is_number) {
    std::uint32_t number = UINT32_MAX;
    std::from_chars(text.data(), text.data() + text.size(), number);
    return number;
  }
  const auto named = config.channels.find(text);
  return named != config.channels.end() ? named->second : hashed_channel(text);
}

End read_end(const TableReader& table, const std::string& key, const Config& config) {
  std::string text;
  table.read_text(key, text);
  if (text.empty()) table.fail_missing(key, "add " + key + " = \"LINK/CHANNEL\"");
  const auto link = link_of(text, config);
  if (!link) {
    std::string names;
    for (const LinkConfig& each : config.links) {
      names += (names.empty() ? "" : ", ") + printable(each.name);
    }
    table.fail(key, "\"" + printable(text) +
                        "\" does not begin with a link's name and a slash; write \"" +
                        "LINK/CHANNEL\" with one of the links " + names);
  }
  const LinkConfig& config_link = config.links[*link];
  const std::string channel = text.substr(config_link.name.size() + 1);
  if (!is_legal_name(channel)) {
    table.fail(key, "\"" + printable(text) + "\" names no channel; write \"LINK/CHANNEL\"");
  }
  const std::uint32_t number = channel_number(channel, config);
  const std::uint16_t most = profile_entry(config_link.profile).limits.max_channel;
  if (number > most) {
    const bool is_hashed = number <= 0xFFFF && channel != text_of(number);
    table.fail(key, "channel '" + printable(channel) + "'" +
                        (is_hashed ? " (number " + text_of(number) + ")" : "") +
                        " does not exist on " + profile_text(config_link) + "; it has 0 to " +
                        text_of(most));
  }
  return {*link, static_cast<std::uint16_t>(number)};
}

bool is_same(const GatewayRule& a, const GatewayRule& b) {
  return a.from_link == b.from_link && a.from_channel == b.from_channel && a.to_link == b.to_link &&
         a.to_channel == b.to_channel;
}

void add(const TableReader& table, const GatewayRule& rule, Config& config) {
  for (const GatewayRule& other : config.gateways) {
    if (is_same(rule, other)) {
      table.fail("to", "repeats another [[gateway]] rule between the same channels; remove one");
    }
  }
  const ProfileEntry& target = profile_entry(config.links[rule.to_link].profile);
  if (rule.ttl && *rule.ttl > target.limits.max_ttl) {
    table.fail("ttl", text_of(*rule.ttl) + " is too large for " +
                          profile_text(config.links[rule.to_link]) + "; use 0 to " +
                          text_of(target.limits.max_ttl));
  }
  config.links[rule.to_link].is_gateway_target = true;
  config.gateways.push_back(rule);
}

void read_rule(const TableReader& table, Config& config) {
  table.expect_keys({"from", "to", "both_ways", "ttl", "queue_messages"});
  const End from = read_end(table, "from", config);
  const End to = read_end(table, "to", config);
  if (from.link == to.link) {
    table.fail("to", "is on the same link as 'from'; a gateway joins two links");
  }
  GatewayRule rule{from.link, from.channel, to.link, to.channel, std::nullopt};
  bool both_ways = false;
  table.read_bool("both_ways", both_ways);
  if (table.has("ttl")) {
    std::uint8_t ttl = 0;
    table.read_integer("ttl", {0, 255}, ttl);
    rule.ttl = ttl;
  }
  table.read_integer("queue_messages", kGatewayQueueLimits, rule.queue_messages);
  add(table, rule, config);
  if (!both_ways) return;
  std::swap(rule.from_link, rule.to_link);
  std::swap(rule.from_channel, rule.to_channel);
  add(table, rule, config);
}

}  // namespace

void read_gateways(const TableReader& root, KeyLines& lines, Config& config) {
  for (const toml::table* each : root.tables("gateway")) {
    read_rule(TableReader(*each, "gateway", lines), config);
    if (config.gateways.size() > kMaxGatewayRules) {
      throw lines.error("gateway", "has more than " + text_of(kMaxGatewayRules) +
                                       " rules (both_ways makes two); remove some");
    }
  }
}

void check_channels(const TableReader& root, KeyLines& lines, const Config& config) {
  const TableReader reader(root.table("channels"), "channels", lines);
  std::uint16_t most = 0;
  for (const LinkConfig& link : config.links) {
    most = std::max(most, profile_entry(link.profile).limits.max_channel);
  }
  for (const auto& [name, number] : config.channels) {
    if (number <= most) continue;
    reader.fail(name, text_of(number) + " exists on no link: their profiles have the channels 0 " +
                          "to " + text_of(most));
  }
}

std::optional<OwnIds> own_ids(const Config& config, const LinkConfig& link) {
  const StationLimits& limits = profile_entry(link.profile).limits;
  const bool is_marked = limits.first_gateway_id <= limits.max_node_id;
  if (is_marked && link.is_gateway_target) {
    return OwnIds{limits.first_gateway_id, limits.max_node_id};
  }
  const std::uint16_t most =
      is_marked ? static_cast<std::uint16_t>(limits.first_gateway_id - 1) : limits.max_node_id;
  if (most >= kNodeIdLimits.most || (config.node.id && *config.node.id <= most)) {
    return std::nullopt;
  }
  return OwnIds{1, most};
}

void check_node_ids(const KeyLines& lines, const Config& config) {
  for (const LinkConfig& link : config.links) {
    const auto range = own_ids(config, link);
    const std::string key = "links." + printable(link.name);
    if (link.node_id) {
      const StationLimits& limits = profile_entry(link.profile).limits;
      const bool is_marked = limits.first_gateway_id <= limits.max_node_id;
      const bool says_gateway = *link.node_id >= limits.first_gateway_id;
      if (!is_marked || says_gateway == link.is_gateway_target) continue;
      throw lines.error(
          key + ".node_id",
          text_of(*link.node_id) +
              (says_gateway ? " says that this robot is a gateway to the link, and no [[gateway]] "
                              "rule copies to it; use 1 to "
                            : " says nothing of the gateway that this robot is to the link, and "
                              "its packets have no room for that; use ") +
              (says_gateway
                   ? text_of(limits.first_gateway_id - 1)
                   : text_of(limits.first_gateway_id) + " to " + text_of(limits.max_node_id)));
    }
    if (!range || !config.node.id) continue;
    throw lines.error(key, "has no 'node_id', and node.id " + text_of(*config.node.id) +
                               (link.is_gateway_target && *config.node.id <= range->most
                                    ? " does not say that this robot is a gateway to "
                                    : " does not fit the packets of ") +
                               profile_text(link) + "; add node_id = " + text_of(range->least) +
                               " to " + text_of(range->most));
  }
}

}  // namespace swarmtalk::daemon
