// Fuzz target: what the kernel answers about a radio, with the beacons and stations of strangers in
// it. First byte: 0: the rest is one whole netlink message; else it is attributes behind a header
// as the kernel makes it, and odd: elements of a beacon inside them.
#include <linux/nl80211.h>
#include <netlink/genl/genl.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "nl80211/radio.hpp"

namespace {

using namespace swarmtalk::nl80211;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kAlign = 4;

/// Gives the same answer to every question.
class OneAnswer final : public Asker {
 public:
  explicit OneAnswer(Bytes message) : message_(std::move(message)) {}
  Answer ask(const Question&) override { return {0, {message_, message_}}; }

 private:
  Bytes message_;
};

Bytes attribute(std::uint16_t type, std::span<const std::uint8_t> value) {
  const nlattr head{static_cast<std::uint16_t>(sizeof(nlattr) + value.size()), type};
  Bytes made(sizeof head);
  std::memcpy(made.data(), &head, sizeof head);
  made.insert(made.end(), value.begin(), value.end());
  made.resize((made.size() + kAlign - 1) / kAlign * kAlign);
  return made;
}

Bytes message(std::span<const std::uint8_t> attributes) {
  Bytes made(NLMSG_HDRLEN + GENL_HDRLEN);
  made.insert(made.end(), attributes.begin(), attributes.end());
  nlmsghdr head{};
  head.nlmsg_len = static_cast<std::uint32_t>(made.size());
  std::memcpy(made.data(), &head, sizeof head);
  return made;
}

Bytes scan_with(std::span<const std::uint8_t> elements) {
  const std::uint32_t joined = NL80211_BSS_STATUS_IBSS_JOINED;
  std::uint8_t status[sizeof joined];
  std::memcpy(status, &joined, sizeof joined);
  Bytes inside = attribute(NL80211_BSS_STATUS, status);
  const Bytes beacon = attribute(NL80211_BSS_BEACON_IES, elements);
  inside.insert(inside.end(), beacon.begin(), beacon.end());
  return message(attribute(NL80211_ATTR_BSS, inside));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> rest(bytes + 1, size - 1);
  OneAnswer asker(bytes[0] == 0       ? Bytes(rest.begin(), rest.end())
                  : bytes[0] % 2 == 0 ? message(rest)
                                      : scan_with(rest));
  if (const auto interface = interface_of(asker, 3)) {
    if (name_of(interface->mode) == nullptr || word_of(interface->mode) == nullptr) std::abort();
    if (interface->frequency_mhz && channel_of(*interface->frequency_mhz) < 0) std::abort();
  }
  if (const auto stations = stations_of(asker, 3)) {
    if (stations->size() > 2) std::abort();
    for (const Station& each : *stations) {
      if (each.address == 0) std::abort();
    }
  }
  if (const auto network = network_of(asker, 3)) {
    for (const double rate : network->basic_rates_mbps) {
      if (!(rate > 0 && rate <= 54)) std::abort();
    }
    if (network->name.size() > size || network->country.size() > 2) std::abort();
  }
  has_power_save(asker, 3);
  if (const auto country = country_of(asker, 0); country && country->size() != 2) std::abort();
  return 0;
}
