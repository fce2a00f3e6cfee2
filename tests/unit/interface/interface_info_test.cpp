// What is read from the kernel's answers, which are made here.
#include "interface/interface_info.hpp"

#include <gtest/gtest.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

namespace swarmtalk {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& to, const void* from, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(from);
  to.insert(to.end(), bytes, bytes + size);
  to.resize(NLMSG_ALIGN(to.size()));
}

Bytes attribute(int type, const Bytes& value) {
  const rtattr head{static_cast<unsigned short>(RTA_LENGTH(value.size())),
                    static_cast<unsigned short>(type)};
  Bytes made;
  append(made, &head, sizeof head);
  append(made, value.data(), value.size());
  return made;
}

Bytes text(const std::string& words) {
  Bytes made(words.begin(), words.end());
  made.push_back(0);
  return made;
}

Bytes number(std::uint32_t value) {
  Bytes made;
  append(made, &value, sizeof value);
  return made;
}

Bytes answer(unsigned flags, std::initializer_list<Bytes> attributes = {}) {
  nlmsghdr head{};
  head.nlmsg_type = RTM_NEWLINK;
  ifinfomsg link{};
  link.ifi_type = ARPHRD_ETHER;
  link.ifi_index = 3;
  link.ifi_flags = flags;
  Bytes made;
  append(made, &head, sizeof head);
  append(made, &link, sizeof link);
  for (const Bytes& each : attributes) made.insert(made.end(), each.begin(), each.end());
  return made;
}

Bytes master(const std::string& kind) {
  Bytes made = attribute(IFLA_MASTER, number(9));
  const Bytes of = attribute(IFLA_LINKINFO, attribute(IFLA_INFO_SLAVE_KIND, text(kind)));
  made.insert(made.end(), of.begin(), of.end());
  return made;
}

TEST(InterfaceInfo, IsReadFromTheKernelsAnswer) {
  const InterfaceInfo info = read_interface(
      answer(IFF_UP | IFF_RUNNING | 1u << 16,
             {attribute(IFLA_IFNAME, text("wlan0")), attribute(IFLA_MTU, number(1500)),
              attribute(IFLA_ADDRESS, {2, 0, 0, 0, 0, 7})}));
  EXPECT_EQ(info.index, 3u);
  EXPECT_EQ(info.name, "wlan0");
  EXPECT_EQ(info.mtu_bytes, 1500u);
  EXPECT_EQ(info.mac, (std::array<std::uint8_t, 6>{2, 0, 0, 0, 0, 7}));
  EXPECT_TRUE(info.is_switched_on && info.has_carrier && info.is_ethernet);
  EXPECT_FALSE(info.is_loopback);
  EXPECT_FALSE(read_interface(answer(IFF_UP)).has_carrier);
  EXPECT_TRUE(read_interface(answer(IFF_LOOPBACK)).is_loopback);
}

TEST(InterfaceInfo, ADormantOneHasCarrier) {
  const auto read = [](unsigned flags, std::uint8_t state) {
    return read_interface(answer(flags, {attribute(IFLA_OPERSTATE, {state})}));
  };
  constexpr unsigned kLowerUp = 1 << 16;
  constexpr std::uint8_t kDown = 2, kDormant = 5, kUp = 6;  // RFC 2863
  EXPECT_TRUE(read(IFF_UP | kLowerUp, kDormant).has_carrier);
  EXPECT_TRUE(read(IFF_UP | kLowerUp, kDormant).is_dormant);
  EXPECT_FALSE(read(IFF_UP, kDormant).has_carrier);
  EXPECT_FALSE(read(IFF_UP, kDormant).is_dormant);
  EXPECT_FALSE(read(IFF_UP | kLowerUp, kDown).has_carrier) << "not noticed yet";
  EXPECT_FALSE(read(IFF_UP | kLowerUp | IFF_RUNNING, kUp).is_dormant);
}

/// A folder as /sys/class/net.
class Rfkill : public testing::Test {
 protected:
  Rfkill() : folder_(testing::TempDir() + "rfkill" + std::to_string(getpid())) {}
  ~Rfkill() override { std::filesystem::remove_all(folder_); }

  void set(const std::string& name, const char* soft, const char* hard) {
    const auto radio = std::filesystem::path(folder_) / "wlan0" / "phy80211" / name;
    std::filesystem::create_directories(radio);
    std::ofstream(radio / "soft") << soft << '\n';
    std::ofstream(radio / "hard") << hard << '\n';
  }

  const std::string folder_;
};

TEST_F(Rfkill, BlocksARadioSoftlyOrByASwitch) {
  EXPECT_EQ(block_of("wlan0", folder_), RadioBlock::kNone);
  set("rfkill0", "0", "0");
  set("power", "1", "1");
  EXPECT_EQ(block_of("wlan0", folder_), RadioBlock::kNone);
  set("rfkill0", "1", "0");
  EXPECT_EQ(block_of("wlan0", folder_), RadioBlock::kSoft);
  EXPECT_EQ(block_of("wlan1", folder_), RadioBlock::kNone);
  set("rfkill1", "0", "1");
  EXPECT_EQ(block_of("wlan0", folder_), RadioBlock::kHard);
}

TEST(InterfaceInfo, OnlyABridgeTakesThePortsFrames) {
  EXPECT_EQ(read_interface(answer(IFF_UP, {master("bridge")})).bridge_index, 9u);
  for (const char* const kind : {"bond", "team", "vrf", "batadv", ""}) {
    EXPECT_EQ(read_interface(answer(IFF_UP, {master(kind)})).bridge_index, 0u) << kind;
  }
}

TEST(InterfaceInfo, ARouteWithoutAnAddressToSendFromIsOne) {
  nlmsghdr head{};
  head.nlmsg_type = RTM_NEWROUTE;
  const rtmsg route{};
  Bytes made;
  append(made, &head, sizeof head);
  EXPECT_FALSE(is_without_source(made)) << "no answer";
  append(made, &route, sizeof route);
  EXPECT_TRUE(is_without_source(made));
  const Bytes source = attribute(RTA_PREFSRC, {10, 83, 84, 1});
  made.insert(made.end(), source.begin(), source.end());
  EXPECT_FALSE(is_without_source(made));
  EXPECT_FALSE(is_without_source(answer(IFF_UP)));
}

TEST(InterfaceInfo, ARouteSaysWhoseAddressItIs) {
  nlmsghdr head{};
  head.nlmsg_type = RTM_NEWROUTE;
  rtmsg route{};
  for (const auto& [type, is_ours] : {std::pair{RTN_BROADCAST, true},
                                      {RTN_LOCAL, true},
                                      {RTN_UNICAST, false},
                                      {RTN_UNREACHABLE, false}}) {
    route.rtm_type = static_cast<unsigned char>(type);
    Bytes made;
    append(made, &head, sizeof head);
    EXPECT_FALSE(is_broadcast(made)) << "no answer";
    append(made, &route, sizeof route);
    EXPECT_EQ(is_broadcast(made), is_ours) << type;
  }
}

TEST(InterfaceInfo, AnAnswerThatIsCutIsReadAsFarAsItGoes) {
  const Bytes whole = answer(IFF_UP, {attribute(IFLA_IFNAME, text("wlan0")), master("bridge")});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(read_interface(cut).bridge_index, 0u) << size;
  }
  Bytes error = whole;
  const std::uint16_t type = NLMSG_ERROR;
  std::memcpy(error.data() + offsetof(nlmsghdr, nlmsg_type), &type, sizeof type);
  EXPECT_EQ(read_interface(error).index, 0u);
}

}  // namespace
}  // namespace swarmtalk
