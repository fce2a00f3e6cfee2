// UdpLinks on the loopback interface, as several daemons on one machine use them.
#include "drivers/socket/udp.hpp"

#include <gtest/gtest.h>

#include "drivers/socket/interface_watch.hpp"
#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

/// A port that parallel tests do not share.
UdpConfig loopback_config() {
  UdpConfig config;
  config.interface = "lo";
  config.port = udp_port();
  return config;
}

void expect_refused(const UdpConfig& config, const std::string& words) {
  boost::asio::io_context io;
  try {
    UdpLink link(io, config);
    FAIL() << "was accepted";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

class UdpLinkTest : public ::testing::Test {
 protected:
  void exchange_among_three(const UdpConfig& config) {
    UdpLink first(io_, config), second(io_, config), third(io_, config);
    TestLinkUser users[] = {TestLinkUser(1), TestLinkUser(2), TestLinkUser(3)};
    UdpLink* const links[] = {&first, &second, &third};
    for (std::size_t i = 0; i < 3; ++i) {
      links[i]->start(users[i]);
      ASSERT_TRUE(links[i]->is_up()) << links[i]->state();
      users[i].waiting.push_back(numbered_packet(static_cast<std::uint32_t>(i), 30));
      links[i]->wake();
    }
    EXPECT_TRUE(run_until(io_, [&] {
      return users[0].received.size() == 2 && users[1].received.size() == 2 &&
             users[2].received.size() == 2 && counter(first, "own_echoes") == 1;
    }));
    run_for(io_, 20ms);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(users[i].received.size(), 2U);
      EXPECT_EQ(counter(*links[i], "own_echoes"), 1U);
      for (const FrameReception& reception : users[i].receptions) {
        EXPECT_NE(reception.transmitter, i + 1) << "heard itself";
      }
    }
  }

  boost::asio::io_context io_;
};

TEST_F(UdpLinkTest, HearsOthersInItsGroupButNotItself) {
  exchange_among_three(loopback_config());
}

TEST_F(UdpLinkTest, OthersPacketsWaitBeforeTheyAreSentOnAndOurOwnDoNot) {
  UdpConfig config = loopback_config();
  config.pacer.max_forward_jitter = 10s;
  UdpLink first(io_, config), second(io_, config);
  TestLinkUser relay(1), hearer(2);
  first.start(relay);
  second.start(hearer);
  EXPECT_EQ(first.settings().forward_jitter, 10s);
  relay.own_waiting = 0;
  for (int i = 0; i < 5 && relay.waiting.empty(); ++i) {  // a random wait may be short
    relay.waiting.push_back(numbered_packet(1, 30));
    first.wake();
    run_for(io_, 20ms);
  }
  ASSERT_FALSE(relay.waiting.empty());
  const std::size_t packets = hearer.received.size();
  const std::size_t frames = hearer.frames.size();
  relay.waiting.push_back(numbered_packet(2, 30));
  relay.own_waiting = 1;
  first.wake();
  EXPECT_TRUE(run_until(io_, [&] { return hearer.received.size() == packets + 2; }));
  EXPECT_EQ(hearer.frames.size(), frames + 1) << "both in one";
}

TEST_F(UdpLinkTest, NothingIsHeldBackOnAnInterfaceThatIsNoRadio) {
  UdpLink link(io_, loopback_config());
  TestLinkUser user(1);
  link.start(user);
  ASSERT_TRUE(link.is_up());
  EXPECT_EQ(link.settings().forward_jitter, 0s);
  for (const char* const name : {"", "lo", "nosuch0", ".", "../net/lo"}) {
    EXPECT_FALSE(is_radio(name)) << name;
  }
}

TEST_F(UdpLinkTest, HearsOthersThroughABroadcastAddress) {
  UdpConfig config = loopback_config();
  config.address = "127.255.255.255";
  exchange_among_three(config);
}

TEST_F(UdpLinkTest, HearsANeighbourOfTheSameEpoch) {
  UdpLink first(io_, loopback_config()), second(io_, loopback_config());
  TestLinkUser sender(1), hearer(1);
  first.start(sender);
  second.start(hearer);
  sender.waiting.push_back(numbered_packet(5, 30));
  first.wake();
  EXPECT_TRUE(run_until(io_, [&] { return !hearer.received.empty(); }));
}

TEST_F(UdpLinkTest, DoesNotHearAnotherGroupOnTheSamePort) {
  UdpConfig other = loopback_config();
  other.address = "239.255.83.85";
  UdpLink first(io_, loopback_config()), second(io_, other);
  TestLinkUser sender(1), hearer(2);
  first.start(sender);
  second.start(hearer);
  sender.waiting.push_back(numbered_packet(5, 30));
  first.wake();
  EXPECT_TRUE(run_until(io_, [&] { return counter(first, "own_echoes") == 1; }));
  EXPECT_TRUE(hearer.received.empty());
}

TEST_F(UdpLinkTest, CarriesManyPacketsInOrderWithoutLoss) {
  constexpr std::uint32_t kPackets = 10000;
  constexpr std::uint32_t kWindow = 256;
  UdpLink first(io_, loopback_config()), second(io_, loopback_config());
  TestLinkUser sender(1), hearer(2);
  first.start(sender);
  second.start(hearer);
  std::uint32_t next = 0;
  hearer.on_received = [&](const Bytes& packet) {
    ASSERT_EQ(packet_number(packet), hearer.received.size() - 1);
  };
  const bool is_complete = run_until(io_, [&] {
    while (next < kPackets && next < hearer.received.size() + kWindow) {
      sender.waiting.push_back(numbered_packet(next, 4 + next % 1390));
      ++next;
    }
    if (!sender.waiting.empty()) first.wake();
    return hearer.received.size() >= kPackets;
  });
  EXPECT_TRUE(is_complete) << hearer.received.size();
  EXPECT_EQ(counter(second, "kernel_drops"), 0U);
  EXPECT_LT(counter(first, "frames_sent"), kPackets);
}

TEST_F(UdpLinkTest, FindsAKernelStampNoOlderThanTheSending) {
  UdpLink first(io_, loopback_config()), second(io_, loopback_config());
  TestLinkUser sender(1), hearer(2);
  first.start(sender);
  second.start(hearer);
  const MonotonicTime before = std::chrono::steady_clock::now();
  sender.waiting.push_back(numbered_packet(5, 30));
  first.wake();
  ASSERT_TRUE(run_until(io_, [&] { return !hearer.received.empty(); }));
  EXPECT_GE(hearer.receptions[0].received_at, before - 1ms);
  EXPECT_LE(hearer.receptions[0].received_at, std::chrono::steady_clock::now());
}

TEST(InterfaceObstacle, IsNamedByWhatIsInTheWay) {
  InterfaceInfo healthy;
  healthy.index = 3;
  healthy.name = "wlan0";
  healthy.is_switched_on = healthy.has_carrier = healthy.is_radio = true;
  EXPECT_EQ(obstacle_of(healthy), "");
  EXPECT_EQ(remark_on(healthy), "");
  const auto names = [&](const auto& edit, const std::string& remedy) {
    InterfaceInfo interface = healthy;
    edit(interface);
    EXPECT_NE(obstacle_of(interface).find(remedy), std::string::npos) << obstacle_of(interface);
  };
  names([](auto& each) { each.is_switched_on = false; }, "(ip link set wlan0 up)");
  names([](auto& each) { each.has_carrier = false; }, "join its Wi-Fi");
  names([](auto& each) { each.bridge = "br0"; }, "set interface = \"br0\"");
  names([](auto& each) { each.is_dormant = true; }, "ip link set wlan0 mode default state up");
  const auto block = [](RadioBlock by) {
    return [by](auto& each) {
      each.is_switched_on = false;
      each.block = by;
    };
  };
  names(block(RadioBlock::kSoft), "(rfkill unblock wifi, then ip link set wlan0 up;");
  names(block(RadioBlock::kHard), "(turn that on, then ip link set wlan0 up)");
  healthy.is_radio = false;
  healthy.is_dormant = true;
  EXPECT_EQ(obstacle_of(healthy), "") << "frames pass on a cable";
  EXPECT_NE(remark_on(healthy).find("ip link set wlan0 mode default state up"), std::string::npos);
}

TEST(UdpLinkConfig, NamesItsPlace) {
  boost::asio::io_context io;
  UdpConfig config = loopback_config();
  config.port = 21332;
  EXPECT_EQ(UdpLink(io, config).device(), "239.255.83.84:21332 on lo");
}

TEST(UdpLinkConfig, RefusesWhatIsNoAddress) {
  UdpConfig config = loopback_config();
  config.address = "localhost";
  expect_refused(config, "not an IPv4 address");
}

TEST(UdpLinkConfig, RefusesAnAddressOfNoGroupAndNoNetwork) {
  UdpConfig config = loopback_config();
  config.address = "203.0.113.7";
  expect_refused(config, "neither a multicast group nor a broadcast address");
}

TEST(UdpLinkConfig, WaitsForAnInterfaceThatIsNotThereAndNamesThoseThatAre) {
  UdpConfig config = loopback_config();
  config.interface = "absent0";
  for (const char* const address : {"239.255.83.84", "203.0.113.7"}) {
    config.address = address;  // the second is nobody's yet: it may come with the interface
    boost::asio::io_context io;
    UdpLink link(io, config);
    EXPECT_NE(link.missing().find(": no interface 'absent0'; this machine has lo"),
              std::string::npos)
        << link.missing();
    TestLinkUser user(1);
    link.start(user);
    EXPECT_FALSE(link.is_up());
    EXPECT_EQ(link.state().find(
                  "down: waiting for interface 'absent0'; at the start this machine had lo"),
              0u)
        << link.state();
  }
  boost::asio::io_context io;
  EXPECT_EQ(UdpLink(io, loopback_config()).missing(), "");
}

TEST(UdpLinkConfig, RefusesPortZero) {
  UdpConfig config = loopback_config();
  config.port = 0;
  expect_refused(config, "port must be 1 to 65535");
}

}  // namespace
}  // namespace swarmtalk::drivers
