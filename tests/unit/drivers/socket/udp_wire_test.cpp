// UdpLinks on a real wire: datagrams that stay on the local network, and the interface's changes.
#include <gtest/gtest.h>

#include "drivers/socket/udp.hpp"
#include "tests/unit/drivers/test_network.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

class UdpWire : public ::testing::Test {
 protected:
  void SetUp() override {
    SWARMTALK_SKIP_WITHOUT_ROOT();
    network_.emplace();
    config_.interface = "air0";
    add_addresses();
  }

  void add_addresses() {
    network_->ip('a', "addr add 10.83.84.1/24 brd + dev air0");
    network_->ip('b', "addr add 10.83.84.2/24 brd + dev air0");
  }

  void expect_exchange() {
    const std::size_t a_had = user_a_.received.size();
    const std::size_t b_had = user_b_.received.size();
    user_a_.waiting.push_back(numbered_packet(1, 1400));
    user_b_.waiting.push_back(numbered_packet(2, 1400));
    a_->wake();
    b_->wake();
    ASSERT_TRUE(run_until(
        io_, [&] { return user_a_.received.size() > a_had && user_b_.received.size() > b_had; }))
        << "a: " << a_->state() << "; b: " << b_->state();
    EXPECT_EQ(user_b_.received.back(), numbered_packet(1, 1400));
  }

  void open() {
    a_ = network_->link<UdpLink>('a', io_, config_);
    b_ = network_->link<UdpLink>('b', io_, config_);
    a_->start(user_a_);
    b_->start(user_b_);
  }

  std::optional<TestNetwork> network_;
  boost::asio::io_context io_;
  UdpConfig config_;
  TestLinkUser user_a_{1};
  TestLinkUser user_b_{2};
  std::unique_ptr<UdpLink> a_;
  std::unique_ptr<UdpLink> b_;
};

TEST_F(UdpWire, SendsWholeDatagramsWithTtlOne) {
  open();
  WireProbe probe(*network_, 'b');
  expect_exchange();
  int datagrams = 0;
  for (const Bytes& bytes : probe.heard()) {
    const bool is_ipv4_udp =
        bytes.size() > 42 && bytes[12] == 0x08 && bytes[13] == 0x00 && bytes[23] == 17;
    if (!is_ipv4_udp) continue;  // the kernel's own: group membership
    ++datagrams;
    EXPECT_EQ(bytes[22], 1) << "TTL";
    EXPECT_EQ(bytes[20] & 0x3F, 0) << "fragment";
    EXPECT_LE(bytes.size(), 1514U);
  }
  EXPECT_EQ(datagrams, 1);
}

TEST_F(UdpWire, UsesTheNetworksBroadcastAddress) {
  config_.address = "10.83.84.255";
  open();
  expect_exchange();
}

// There is no route to 255.255.255.255; what is sent there leaves by the configured interface.
TEST_F(UdpWire, UsesTheBroadcastAddressOfAllNetworksWithoutARoute) {
  config_.address = "255.255.255.255";
  open();
  expect_exchange();
  network_->ip('a', "link del air0");
  ASSERT_TRUE(run_until(io_, [&] { return !a_->is_up() && !b_->is_up(); })) << a_->state();
  network_->add_pair();
  add_addresses();
  ASSERT_TRUE(run_until(io_, [&] { return a_->is_up() && b_->is_up(); })) << a_->state();
  expect_exchange();
}

TEST_F(UdpWire, DoesNotHearItsGroupOnAnotherInterface) {
  open();
  UdpConfig local_config = config_;
  local_config.interface = "lo";
  TestLinkUser user_local(3);
  const auto local = network_->link<UdpLink>('a', io_, local_config);
  local->start(user_local);
  expect_exchange();
  run_for(io_, 20ms);
  EXPECT_TRUE(user_local.received.empty());
}

TEST_F(UdpWire, JoinsAgainWhenTheInterfaceReturns) {
  open();
  expect_exchange();
  network_->ip('a', "link del air0");
  EXPECT_TRUE(run_until(io_, [&] {
    return a_->state() == "down: interface 'air0' is gone (ip link lists those there are)" &&
           !b_->is_up();
  })) << a_->state();
  network_->add_pair();
  add_addresses();
  ASSERT_TRUE(run_until(io_, [&] { return a_->is_up() && b_->is_up(); })) << a_->state();
  expect_exchange();
  EXPECT_EQ(counter(*a_, "link_down_events"), 1U);
}

TEST_F(UdpWire, NeverFragmentsOnASmallMtu) {
  config_.max_packet_bytes = 200;
  network_->ip('a', "link set air0 mtu 600");
  open();
  WireProbe probe(*network_, 'b');
  for (std::uint32_t i = 0; i < 10; ++i) user_a_.waiting.push_back(numbered_packet(i, 200));
  a_->wake();
  ASSERT_TRUE(run_until(io_, [&] { return user_b_.received.size() == 10; }));
  for (const Bytes& bytes : probe.heard()) EXPECT_LE(bytes.size(), 614U);
}

}  // namespace
}  // namespace swarmtalk::drivers
