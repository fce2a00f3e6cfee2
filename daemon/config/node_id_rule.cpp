#include "daemon/config/node_id_rule.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <unistd.h>

#include <array>
#include <map>
#include <memory>

#include "daemon/common/printable.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr const char* kIdKey = "node.id";
constexpr std::size_t kMaxDigits = 9;
constexpr std::string_view kDecimal = "0123456789";

/// Interface to its first IPv4 address, without loopback.
std::map<std::string, in_addr> addresses() {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return {};
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(list, &freeifaddrs);
  std::map<std::string, in_addr> found;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    if ((entry->ifa_flags & IFF_LOOPBACK) != 0) continue;
    found.emplace(entry->ifa_name, reinterpret_cast<const sockaddr_in*>(entry->ifa_addr)->sin_addr);
  }
  return found;
}

std::int64_t number_of_address(const NodeConfig& node, const KeyLines& lines) {
  const std::map<std::string, in_addr> found = addresses();
  if (!node.id_interface.empty()) {
    const auto wanted = found.find(node.id_interface);
    if (wanted != found.end()) return ntohl(wanted->second.s_addr) & 0xFFu;
    throw lines.error("node.id_interface", "\"" + printable(node.id_interface) +
                                               "\" has no IPv4 address (yet?); the daemon can only "
                                               "take its id from one when it is there");
  }
  if (found.size() == 1) return ntohl(found.begin()->second.s_addr) & 0xFFu;
  if (found.empty()) {
    throw lines.error(kIdKey, "is \"ip\", but this machine has no IPv4 address (yet?)");
  }
  std::string names;
  for (const auto& [name, address] : found) names += (names.empty() ? "" : ", ") + name;
  throw lines.error(kIdKey, "is \"ip\", and " + names +
                                " have IPv4 addresses; say which counts with id_interface");
}

}  // namespace

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

std::optional<std::int64_t> number_in_hostname(const std::string& name) {
  const std::size_t last = name.find_last_of(kDecimal);
  if (last == std::string::npos) return std::nullopt;
  const std::size_t before = name.find_last_not_of(kDecimal, last);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  const std::string digits = name.substr(first, last - first + 1);
  if (digits.size() > kMaxDigits) return std::nullopt;
  return std::stoll(digits);
}

std::optional<std::uint16_t> resolve_node_id(const NodeConfig& node, const KeyLines& lines) {
  if (node.id_rule == NodeIdRule::kRandom) return std::nullopt;
  if (node.id_rule == NodeIdRule::kNumber) return node.id;
  std::int64_t number = 0;
  std::string source;
  if (node.id_rule == NodeIdRule::kHostname) {
    std::array<char, 256> name{};
    gethostname(name.data(), name.size() - 1);
    const auto found = number_in_hostname(name.data());
    source = "the host's name '" + printable(name.data()) + "'";
    if (!found) {
      throw lines.error(kIdKey, "is \"hostname\", but " + source +
                                    " has no number in it; rename the host (hostnamectl hostname "
                                    "robot7), or give a number");
    }
    number = *found;
  } else {
    number = number_of_address(node, lines);
    source = "the IPv4 address";
  }
  const std::int64_t id = number + node.id_offset;
  if (id >= kNodeIdLimits.least && id <= kNodeIdLimits.most) return static_cast<std::uint16_t>(id);
  throw lines.error(
      kIdKey, source + " and id_offset give " + std::to_string(id) + "; a node id is 1 to 65534");
}

}  // namespace swarmtalk::daemon
