#include "nl80211/radio.hpp"

#include <linux/nl80211.h>
#include <netlink/attr.h>
#include <netlink/genl/genl.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <span>

namespace swarmtalk::nl80211 {
namespace {

template <int kMost>
using Attributes = std::array<nlattr*, kMost + 1>;

using Top = Attributes<NL80211_ATTR_MAX>;

/// The attributes of one message. @return false: it is not whole
bool parse(const std::vector<std::uint8_t>& message, Top& attributes) {
  constexpr std::size_t kHead = NLMSG_HDRLEN + GENL_HDRLEN;
  if (message.size() < kHead) return false;
  auto* first = reinterpret_cast<nlattr*>(const_cast<std::uint8_t*>(message.data() + kHead));
  return nla_parse(attributes.data(), NL80211_ATTR_MAX, first,
                   static_cast<int>(message.size() - kHead), nullptr) == 0;
}

template <int kMost>
bool parse_nested(nlattr* outer, Attributes<kMost>& attributes) {
  return outer != nullptr &&
         nla_parse(attributes.data(), kMost, static_cast<nlattr*>(nla_data(outer)), nla_len(outer),
                   nullptr) == 0;
}

/// An attribute's number, if it has exactly this size.
template <typename T>
std::optional<T> number(nlattr* attribute) {
  T value{};
  if (attribute == nullptr || nla_len(attribute) != int{sizeof value}) return std::nullopt;
  std::memcpy(&value, nla_data(attribute), sizeof value);
  return value;
}

std::span<const std::uint8_t> bytes_of(nlattr* attribute) {
  if (attribute == nullptr) return {};
  return {static_cast<const std::uint8_t*>(nla_data(attribute)),
          static_cast<std::size_t>(nla_len(attribute))};
}

std::string text_of(std::span<const std::uint8_t> bytes) {
  return std::string(bytes.begin(), bytes.end());
}

std::uint64_t address_of(nlattr* attribute) {
  std::uint64_t address = 0;
  const auto bytes = bytes_of(attribute);
  if (bytes.size() != 6) return 0;
  for (const std::uint8_t byte : bytes) address = address << 8 | byte;
  return address;
}

Mode mode_of(std::uint32_t type) {
  switch (type) {
    case NL80211_IFTYPE_STATION:
      return Mode::kStation;
    case NL80211_IFTYPE_ADHOC:
      return Mode::kAdHoc;
    case NL80211_IFTYPE_MESH_POINT:
      return Mode::kMesh;
    case NL80211_IFTYPE_AP:
      return Mode::kAccessPoint;
    case NL80211_IFTYPE_MONITOR:
      return Mode::kMonitor;
    case NL80211_IFTYPE_OCB:
      return Mode::kOcb;
    default:
      return Mode::kOther;
  }
}

/// Elements of a beacon: 802.11-2020, 9.4.2.
void read_elements(std::span<const std::uint8_t> bytes, Network& network) {
  constexpr std::uint8_t kSsid = 0;
  constexpr std::uint8_t kRates = 1;
  constexpr std::uint8_t kCountry = 7;
  constexpr std::uint8_t kMoreRates = 50;
  constexpr std::uint8_t kMeshId = 114;
  while (bytes.size() >= 2 && bytes.size() >= std::size_t{2} + bytes[1]) {
    const std::uint8_t id = bytes[0];
    const auto body = bytes.subspan(2, bytes[1]);
    if ((id == kSsid && !body.empty() && body[0] != 0) || (id == kMeshId && !body.empty())) {
      network.name = text_of(body);
    } else if (id == kRates || id == kMoreRates) {
      for (const std::uint8_t each : body) {
        constexpr std::uint8_t kBasic = 0x80;
        constexpr std::uint8_t kLargestRate = 108;  // 54 Mb/s; above are selectors of membership
        const int half_mbps = each & ~kBasic;
        if ((each & kBasic) != 0 && half_mbps > 0 && half_mbps <= kLargestRate) {
          network.basic_rates_mbps.push_back(half_mbps / 2.0);
        }
      }
    } else if (id == kCountry && body.size() >= 2) {
      network.country = text_of(body.first(2));
    }
    bytes = bytes.subspan(std::size_t{2} + bytes[1]);
  }
}

template <typename T>
Question::Value value(std::uint16_t attribute, T number) {
  Question::Value made{attribute, std::vector<std::uint8_t>(sizeof number)};
  std::memcpy(made.bytes.data(), &number, sizeof number);
  return made;
}

Station read_station(nlattr* address, nlattr* outer) {
  Station station;
  station.address = address_of(address);
  Attributes<NL80211_STA_INFO_MAX> facts{};
  if (!parse_nested<NL80211_STA_INFO_MAX>(outer, facts)) return station;
  auto signal = number<std::int8_t>(facts[NL80211_STA_INFO_SIGNAL_AVG]);
  if (!signal) signal = number<std::int8_t>(facts[NL80211_STA_INFO_SIGNAL]);
  if (signal && *signal != 0) station.signal_dbm = *signal;
  Attributes<NL80211_STA_BSS_PARAM_MAX> bss{};
  if (parse_nested<NL80211_STA_BSS_PARAM_MAX>(facts[NL80211_STA_INFO_BSS_PARAM], bss)) {
    station.dtim_period = number<std::uint8_t>(bss[NL80211_STA_BSS_PARAM_DTIM_PERIOD]);
    station.beacon_interval_tu = number<std::uint16_t>(bss[NL80211_STA_BSS_PARAM_BEACON_INTERVAL]);
  }
  return station;
}

}  // namespace

const char* name_of(Mode mode) {
  switch (mode) {
    case Mode::kStation:
      return "client of an access point";
    case Mode::kAdHoc:
      return "ad hoc";
    case Mode::kMesh:
      return "mesh";
    case Mode::kAccessPoint:
      return "access point";
    case Mode::kMonitor:
      return "monitor";
    case Mode::kOcb:
      return "outside a network (OCB)";
    case Mode::kOther:
      break;
  }
  return "another mode";
}

const char* word_of(Mode mode) {
  switch (mode) {
    case Mode::kStation:
      return "managed";
    case Mode::kAdHoc:
      return "ibss";
    case Mode::kMesh:
      return "mesh";
    case Mode::kAccessPoint:
      return "ap";
    case Mode::kMonitor:
      return "monitor";
    case Mode::kOcb:
      return "ocb";
    case Mode::kOther:
      break;
  }
  return "other";
}

std::optional<Interface> interface_of(Asker& asker, unsigned interface) {
  const Answer answer = asker.ask({NL80211_CMD_GET_INTERFACE, false, interface});
  Top top{};
  if (answer.error != 0 || answer.messages.empty() || !parse(answer.messages.front(), top)) {
    return std::nullopt;
  }
  Interface facts;
  facts.mode = mode_of(number<std::uint32_t>(top[NL80211_ATTR_IFTYPE]).value_or(0));
  facts.network = text_of(bytes_of(top[NL80211_ATTR_SSID]));
  facts.frequency_mhz = number<std::uint32_t>(top[NL80211_ATTR_WIPHY_FREQ]);
  facts.wiphy = number<std::uint32_t>(top[NL80211_ATTR_WIPHY]).value_or(0);
  return facts;
}

std::optional<std::vector<Station>> stations_of(Asker& asker, unsigned interface) {
  const Answer answer = asker.ask({NL80211_CMD_GET_STATION, true, interface});
  if (answer.error != 0) return std::nullopt;
  std::vector<Station> stations;
  for (const auto& message : answer.messages) {
    Top top{};
    if (!parse(message, top)) continue;
    const Station station = read_station(top[NL80211_ATTR_MAC], top[NL80211_ATTR_STA_INFO]);
    if (station.address != 0) stations.push_back(station);
  }
  return stations;
}

std::optional<Network> network_of(Asker& asker, unsigned interface) {
  const Answer answer = asker.ask({NL80211_CMD_GET_SCAN, true, interface});
  if (answer.error != 0) return std::nullopt;
  for (const auto& message : answer.messages) {
    Top top{};
    Attributes<NL80211_BSS_MAX> bss{};
    if (!parse(message, top) || !parse_nested<NL80211_BSS_MAX>(top[NL80211_ATTR_BSS], bss)) {
      continue;
    }
    const auto status = number<std::uint32_t>(bss[NL80211_BSS_STATUS]);
    if (status != NL80211_BSS_STATUS_ASSOCIATED && status != NL80211_BSS_STATUS_IBSS_JOINED) {
      continue;
    }
    Network network;
    network.bssid = address_of(bss[NL80211_BSS_BSSID]);
    network.frequency_mhz = number<std::uint32_t>(bss[NL80211_BSS_FREQUENCY]);
    network.beacon_interval_tu = number<std::uint16_t>(bss[NL80211_BSS_BEACON_INTERVAL]);
    const auto beacon = bytes_of(bss[NL80211_BSS_BEACON_IES]);
    read_elements(beacon.empty() ? bytes_of(bss[NL80211_BSS_INFORMATION_ELEMENTS]) : beacon,
                  network);
    return network;
  }
  return std::nullopt;
}

std::optional<bool> has_power_save(Asker& asker, unsigned interface) {
  const Answer answer = asker.ask({NL80211_CMD_GET_POWER_SAVE, false, interface});
  Top top{};
  if (answer.error != 0 || answer.messages.empty() || !parse(answer.messages.front(), top)) {
    return std::nullopt;
  }
  const auto state = number<std::uint32_t>(top[NL80211_ATTR_PS_STATE]);
  if (!state) return std::nullopt;
  return *state == NL80211_PS_ENABLED;
}

std::optional<std::string> country_of(Asker& asker, std::uint32_t wiphy) {
  const Question question{NL80211_CMD_GET_REG, false, 0, {value(NL80211_ATTR_WIPHY, wiphy)}};
  const Answer answer = asker.ask(question);
  Top top{};
  if (answer.error != 0 || answer.messages.empty() || !parse(answer.messages.front(), top)) {
    return std::nullopt;
  }
  const auto letters = bytes_of(top[NL80211_ATTR_REG_ALPHA2]);
  if (letters.size() < 2) return std::nullopt;
  return text_of(letters.first(2));
}

int channel_of(std::uint32_t frequency_mhz) {
  const auto steps = [&](std::uint32_t first) {
    return static_cast<int>(frequency_mhz - first) / 5;
  };
  if (frequency_mhz == 2484) return 14;
  if (frequency_mhz >= 2412 && frequency_mhz <= 2472) return steps(2407);
  if (frequency_mhz >= 5000 && frequency_mhz <= 5925) return steps(5000);
  if (frequency_mhz >= 5955 && frequency_mhz <= 7115) return steps(5950);
  return 0;
}

int switch_power_save_off(Asker& asker, unsigned interface) {
  const std::uint32_t off = NL80211_PS_DISABLED;
  return asker
      .ask({NL80211_CMD_SET_POWER_SAVE, false, interface, {value(NL80211_ATTR_PS_STATE, off)}})
      .error;
}

int request_country(Asker& asker, const std::string& country) {
  Question::Value letters{NL80211_ATTR_REG_ALPHA2, {country.begin(), country.end()}};
  letters.bytes.push_back(0);
  return asker.ask({NL80211_CMD_REQ_SET_REG, false, 0, {letters}}).error;
}

int set_multicast_rate(Asker& asker, unsigned interface, std::uint32_t rate_100kbps) {
  return asker
      .ask({NL80211_CMD_SET_MCAST_RATE,
            false,
            interface,
            {value(NL80211_ATTR_MCAST_RATE, rate_100kbps)}})
      .error;
}

}  // namespace swarmtalk::nl80211
