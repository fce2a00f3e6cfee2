#include "daemon/config/node_id_rule.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <set>
#include <utility>

#include "daemon/common/printable.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr const char* kIdKey = "node.id";
constexpr std::size_t kMaxDigits = 9;
constexpr std::string_view kDecimal = "0123456789";

/// A number that the rule has found, as it is written, and where.
struct Found {
  std::string digits;
  std::string place;   // "the host's name 'robot-07'"
  std::string source;  // the same for the log: "from the host's name 'robot-07'"
};

std::string text_of(std::uint32_t address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  const in_addr in_network_order{htonl(address)};
  inet_ntop(AF_INET, &in_network_order, text.data(), text.size());
  return text.data();
}

std::string name_of(const HostAddress& address) {
  return text_of(address.address) + " of " + printable(address.interface);
}

bool is_link_local(const HostAddress& address) {
  return address.address >> 16 == 0xA9FE;  // 169.254.0.0/16, RFC 3927
}

/// Those that count, sorted. @param left_out  gets the others, with the reason
std::vector<HostAddress> counting(std::vector<HostAddress> all, const std::string& interface,
                                  std::string& left_out) {
  std::sort(all.begin(), all.end(), [](const HostAddress& a, const HostAddress& b) {
    return std::pair(a.interface, a.address) < std::pair(b.interface, b.address);
  });
  std::vector<HostAddress> found;
  for (const HostAddress& each : all) {
    if (!interface.empty() && each.interface != interface) continue;
    const char* reason = is_link_local(each) ? "link-local" : "of an interface that is down";
    if (!is_link_local(each) && each.is_up)
      found.push_back(each);
    else
      left_out += (left_out.empty() ? ": " : ", ") + name_of(each) + " is " + reason;
  }
  return found;
}

Found number_of_address(const NodeConfig& node, const KeyLines& lines, const Host& host) {
  std::string left_out;
  const std::vector<HostAddress> found = counting(host.addresses, node.id_interface, left_out);
  if (found.empty() && node.id_interface.empty()) {
    throw lines.error(kIdKey, "is \"ip\", but this machine has no IPv4 address (yet?)" + left_out);
  }
  if (found.empty()) {
    throw lines.error("node.id_interface", "\"" + printable(node.id_interface) +
                                               "\" has no IPv4 address (yet?)" + left_out +
                                               "; the daemon can only take its id from one when "
                                               "it is there");
  }
  std::set<std::string> interfaces;
  for (const HostAddress& each : found) interfaces.insert(printable(each.interface));
  if (interfaces.size() > 1) {
    std::string names;
    for (const std::string& each : interfaces) names += (names.empty() ? "" : ", ") + each;
    throw lines.error(kIdKey, "is \"ip\", and " + names +
                                  " have IPv4 addresses; say which counts with id_interface");
  }
  const HostAddress& first = found.front();
  const auto differs = [&](const HostAddress& each) {
    return (each.address & 0xFFu) != (first.address & 0xFFu);
  };
  if (std::any_of(found.begin(), found.end(), differs)) {
    std::string all;
    for (const HostAddress& each : found) all += (all.empty() ? "" : ", ") + text_of(each.address);
    throw lines.error(kIdKey, "is \"ip\", and the addresses of " + printable(first.interface) +
                                  " end in different numbers: " + all +
                                  "; use \"hostname\" or a number, or remove all but one");
  }
  return {std::to_string(first.address & 0xFFu), name_of(first), name_of(first)};
}

/// The last number of the name's first label: robot-07.lab2 gives 7.
Found number_of_name(const KeyLines& lines, const Host& host) {
  const std::string label = host.name.substr(0, host.name.find('.'));
  std::vector<std::string> numbers;
  for (std::size_t first = label.find_first_of(kDecimal); first != std::string::npos;) {
    const std::size_t end = std::min(label.find_first_not_of(kDecimal, first), label.size());
    numbers.push_back(label.substr(first, end - first));
    first = label.find_first_of(kDecimal, end);
  }
  const std::string name = "the host's name '" + printable(host.name) + "'";
  if (numbers.empty()) {
    const char* where = label == host.name ? "" : " before its first dot";
    throw lines.error(kIdKey, "is \"hostname\", but " + name + " has no number in it" + where +
                                  "; rename the host (sudo hostnamectl set-hostname robot7), or "
                                  "give a number");
  }
  if (numbers.size() == 1) return {numbers[0], name, "from " + name};
  std::string all;
  for (const std::string& each : numbers) {
    all += (all.empty() ? "" : &each == &numbers.back() ? " and " : ", ") + each;
  }
  const std::string last = "the last of the numbers " + all + " in " + name;
  return {numbers.back(), last, "from " + last};
}

/// @throws ConfigError  it is no node id
std::uint16_t id_of(const Found& found, const NodeConfig& node, const KeyLines& lines) {
  const bool is_name = node.id_rule == NodeIdRule::kHostname;
  const std::string remedy =
      is_name ? "; rename the host (sudo hostnamectl set-hostname robot7), or give a number"
              : "; give a number";
  const std::string digits =
      found.digits.substr(std::min(found.digits.find_first_not_of('0'), found.digits.size() - 1));
  if (digits.size() > kMaxDigits) {
    throw lines.error(kIdKey,
                      found.place + " gives " + digits + "; a node id is 1 to 65534" + remedy);
  }
  const std::int64_t id = std::stoll(digits) + node.id_offset;
  if (id >= kNodeIdLimits.least && id <= kNodeIdLimits.most) return static_cast<std::uint16_t>(id);
  const std::string offset = node.id_offset == 0
                                 ? " gives "
                                 : " and id_offset " + std::to_string(node.id_offset) + " give ";
  throw lines.error(
      kIdKey, found.place + offset + std::to_string(id) + "; a node id is 1 to 65534" + remedy);
}

}  // namespace

Host look_at_host() {
  Host host;
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  host.name = name.data();
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return host;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(list, &freeifaddrs);
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    if ((entry->ifa_flags & IFF_LOOPBACK) != 0) continue;
    const auto& address = *reinterpret_cast<const sockaddr_in*>(entry->ifa_addr);
    HostAddress& made = host.addresses.emplace_back();
    made.interface = entry->ifa_name;
    made.address = ntohl(address.sin_addr.s_addr);
    made.is_up = (entry->ifa_flags & IFF_UP) != 0;
  }
  return host;
}

std::string read_node_id_rule(const std::string& text, NodeConfig& node) {
  node.id.reset();
  if (text == "auto") {
    node.id_rule = NodeIdRule::kRandom;
  } else if (text == "hostname") {
    node.id_rule = NodeIdRule::kHostname;
  } else if (text == "ip") {
    node.id_rule = NodeIdRule::kAddress;
  } else {
    const bool is_number =
        !text.empty() && text.size() <= 5 && text.find_first_not_of(kDecimal) == std::string::npos;
    const std::int64_t number = is_number ? std::stol(text) : 0;
    if (number < kNodeIdLimits.least || number > kNodeIdLimits.most) {
      return "\"" + printable(text) +
             "\" is not known; use \"auto\", \"hostname\", \"ip\" or 1 to 65534";
    }
    node.id_rule = NodeIdRule::kNumber;
    node.id = static_cast<std::uint16_t>(number);
  }
  return {};
}

void resolve_node_id(NodeConfig& node, const KeyLines& lines, const std::function<Host()>& look) {
  if (node.id_rule == NodeIdRule::kRandom) {
    node.id_source = kIdByChance;
    return;
  }
  if (node.id_rule == NodeIdRule::kNumber) {
    node.id_source = std::string("from ") + (lines.is_option(kIdKey) ? "--node-id" : kIdKey);
    return;
  }
  const Host host = look();
  const Found found = node.id_rule == NodeIdRule::kHostname ? number_of_name(lines, host)
                                                            : number_of_address(node, lines, host);
  node.id = id_of(found, node, lines);
  node.id_source = found.source;
  if (node.id_offset != 0) node.id_source += ", id_offset " + std::to_string(node.id_offset);
}

}  // namespace swarmtalk::daemon
