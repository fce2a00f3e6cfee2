#include "interface/interface_info.hpp"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace swarmtalk {
namespace {

// linux/if.h, which does not go together with net/if.h.
constexpr unsigned kLowerUp = 1 << 16;
constexpr std::uint8_t kDormant = 5;

constexpr std::size_t kMostAnswerBytes = 32768;  // statistics and all; virtual functions are more

using Bytes = std::span<const std::uint8_t>;

template <typename Value>
Value value_of(Bytes bytes) {
  Value value{};
  std::memcpy(&value, bytes.data(), std::min(bytes.size(), sizeof value));
  return value;
}

/// Calls `each` with type and bytes of each attribute.
template <typename Each>
void for_attributes(Bytes bytes, Each each) {
  while (bytes.size() >= sizeof(rtattr)) {
    const auto head = value_of<rtattr>(bytes);
    if (head.rta_len < sizeof head || head.rta_len > bytes.size()) return;
    each(head.rta_type & NLA_TYPE_MASK, bytes.first(head.rta_len).subspan(sizeof head));
    bytes = bytes.subspan(std::min<std::size_t>(RTA_ALIGN(head.rta_len), bytes.size()));
  }
}

std::string text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()),
          strnlen(reinterpret_cast<const char*>(bytes.data()), bytes.size())};
}

/// Sends one question and reads its answer. @return 0: there is none
std::size_t ask_kernel(int socket, Bytes question, std::span<std::uint8_t> answer) {
  sockaddr_nl kernel{};
  kernel.nl_family = AF_NETLINK;
  while (recv(socket, answer.data(), answer.size(), MSG_DONTWAIT) >= 0) {  // of earlier questions
  }
  if (sendto(socket, question.data(), question.size(), 0, reinterpret_cast<sockaddr*>(&kernel),
             sizeof kernel) < 0) {
    return 0;
  }
  // The kernel answers within sendto().
  const ssize_t size = recv(socket, answer.data(), answer.size(), MSG_DONTWAIT);
  return size < 0 ? 0 : static_cast<std::size_t>(size);
}

}  // namespace

int open_route_socket(unsigned groups) {
  const int socket = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE);
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = groups;
  if (socket < 0 || bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    const std::string reason = std::strerror(errno);
    if (socket >= 0) close(socket);
    throw std::runtime_error("cannot watch the network interfaces: " + reason);
  }
  return socket;
}

InterfaceInfo read_interface(Bytes answer) {
  InterfaceInfo info;
  if (answer.size() < NLMSG_LENGTH(sizeof(ifinfomsg))) return info;
  if (value_of<nlmsghdr>(answer).nlmsg_type != RTM_NEWLINK) return info;
  const auto link = value_of<ifinfomsg>(answer.subspan(NLMSG_HDRLEN));
  info.index = static_cast<unsigned>(link.ifi_index);
  info.is_switched_on = (link.ifi_flags & IFF_UP) != 0;
  info.has_carrier = (link.ifi_flags & IFF_RUNNING) != 0;
  const bool is_lower_up = (link.ifi_flags & kLowerUp) != 0;
  info.is_loopback = (link.ifi_flags & IFF_LOOPBACK) != 0;
  info.is_ethernet = link.ifi_type == ARPHRD_ETHER;
  unsigned master = 0;
  std::string kind_of_master;
  for_attributes(answer.subspan(NLMSG_SPACE(sizeof link)), [&](int type, Bytes value) {
    if (type == IFLA_IFNAME) info.name = text_of(value);
    if (type == IFLA_OPERSTATE && !value.empty()) {
      info.is_dormant = is_lower_up && value[0] == kDormant;
    }
    if (type == IFLA_MTU) info.mtu_bytes = value_of<std::uint32_t>(value);
    if (type == IFLA_ADDRESS) {
      std::copy_n(value.begin(), std::min(value.size(), info.mac.size()), info.mac.begin());
    }
    if (type == IFLA_MASTER) master = value_of<std::uint32_t>(value);
    if (type != IFLA_LINKINFO) return;
    for_attributes(value, [&](int inner, Bytes text) {
      if (inner == IFLA_INFO_SLAVE_KIND) kind_of_master = text_of(text);
    });
  });
  // Not IFF_LOWER_UP alone: a device with carrier sends only when the kernel has noticed.
  info.has_carrier = info.has_carrier || info.is_dormant;
  // Other masters (bond, team, vrf, batadv) leave a port its frames, or those of our kind.
  if (kind_of_master == "bridge") info.bridge_index = master;
  return info;
}

bool is_without_source(Bytes answer) {
  if (answer.size() < NLMSG_LENGTH(sizeof(rtmsg))) return false;
  if (value_of<nlmsghdr>(answer).nlmsg_type != RTM_NEWROUTE) return false;
  std::uint32_t source = 0;
  for_attributes(answer.subspan(NLMSG_SPACE(sizeof(rtmsg))), [&](int type, Bytes value) {
    if (type == RTA_PREFSRC) source = value_of<std::uint32_t>(value);
  });
  return source == 0;
}

bool is_broadcast(Bytes answer) {
  if (answer.size() < NLMSG_LENGTH(sizeof(rtmsg))) return false;
  if (value_of<nlmsghdr>(answer).nlmsg_type != RTM_NEWROUTE) return false;
  const auto type = value_of<rtmsg>(answer.subspan(NLMSG_HDRLEN)).rtm_type;
  return type == RTN_BROADCAST || type == RTN_LOCAL;
}

InterfaceAsker::InterfaceAsker() : socket_(open_route_socket(0)) {}

InterfaceAsker::~InterfaceAsker() {
  close(socket_);
}

InterfaceInfo InterfaceAsker::ask(unsigned index, const std::string& name) const {
  struct {
    nlmsghdr head;
    ifinfomsg link;
    rtattr name_head;
    std::array<char, IFNAMSIZ> name;
  } question{};
  question.head.nlmsg_type = RTM_GETLINK;
  question.head.nlmsg_flags = NLM_F_REQUEST;
  question.head.nlmsg_len = sizeof question - (index == 0 ? 0 : RTA_SPACE(IFNAMSIZ));
  question.link.ifi_index = static_cast<int>(index);
  question.name_head = {RTA_LENGTH(IFNAMSIZ), IFLA_IFNAME};
  std::copy(name.begin(), name.end(), question.name.begin());
  std::array<std::uint8_t, kMostAnswerBytes> answer;
  const Bytes bytes(reinterpret_cast<const std::uint8_t*>(&question), question.head.nlmsg_len);
  return read_interface(Bytes(answer).first(ask_kernel(socket_, bytes, answer)));
}

InterfaceInfo InterfaceAsker::find(const std::string& name) const {
  if (name.empty() || name.size() >= IFNAMSIZ) return {};
  InterfaceInfo info = ask(0, name);
  info.name = name;
  complete(info);
  return info;
}

InterfaceInfo InterfaceAsker::find(unsigned index) const {
  if (index == 0) return {};
  InterfaceInfo info = ask(index, {});
  complete(info);
  return info;
}

void InterfaceAsker::complete(InterfaceInfo& info) const {
  if (info.index == 0) return;
  if (info.bridge_index != 0) info.bridge = ask(info.bridge_index, {}).name;
  info.is_radio = swarmtalk::is_radio(info.name);
  if (info.is_radio && !info.is_switched_on) info.block = block_of(info.name);
}

std::vector<std::uint8_t> InterfaceAsker::ask_route(unsigned index,
                                                    std::uint32_t destination) const {
  struct {
    nlmsghdr head;
    rtmsg route;
    rtattr to_head;
    std::uint32_t to;
    rtattr through_head;
    std::uint32_t through;
  } question{};
  question.head.nlmsg_type = RTM_GETROUTE;
  question.head.nlmsg_flags = NLM_F_REQUEST;
  question.head.nlmsg_len = sizeof question;
  question.route.rtm_family = AF_INET;
  question.route.rtm_dst_len = 32;
  question.to_head = {RTA_LENGTH(sizeof destination), RTA_DST};
  question.to = destination;
  question.through_head = {RTA_LENGTH(sizeof index), RTA_OIF};
  question.through = index;
  std::vector<std::uint8_t> answer(kMostAnswerBytes);
  const Bytes bytes(reinterpret_cast<const std::uint8_t*>(&question), sizeof question);
  answer.resize(ask_kernel(socket_, bytes, answer));
  return answer;
}

bool InterfaceAsker::lacks_source(unsigned index, std::uint32_t destination) const {
  return is_without_source(ask_route(index, destination));
}

bool InterfaceAsker::is_broadcast(unsigned index, std::uint32_t destination) const {
  return swarmtalk::is_broadcast(ask_route(index, destination));
}

bool is_radio(const std::string& interface) {
  // A name with a slash is none, and would lead elsewhere.
  if (interface.empty() || interface.find('/') != std::string::npos) return false;
  struct stat status {};
  return ::stat(("/sys/class/net/" + interface + "/phy80211").c_str(), &status) == 0;
}

RadioBlock block_of(const std::string& interface, const std::string& folder) {
  const auto is_set = [](const std::filesystem::path& file) {
    char digit = '0';
    return std::ifstream(file) >> digit && digit == '1';
  };
  RadioBlock block = RadioBlock::kNone;
  std::error_code error;
  std::filesystem::directory_iterator each(folder + "/" + interface + "/phy80211", error);
  for (; !error && each != std::filesystem::directory_iterator(); each.increment(error)) {
    if (each->path().filename().string().rfind("rfkill", 0) != 0) continue;
    if (is_set(each->path() / "hard")) return RadioBlock::kHard;
    if (is_set(each->path() / "soft")) block = RadioBlock::kSoft;
  }
  return block;
}

}  // namespace swarmtalk
