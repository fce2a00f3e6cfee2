// UdpLinks on a real wire: datagrams that stay on the local network, and the interface's changes.
#include <gtest/gtest.h>

#include "drivers/socket/udp.hpp"
#include "tests/unit/drivers/test_network.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

class UdpWire : public LinkPair<UdpLink, UdpConfig> {
 protected:
  void SetUp() override {
    LinkPair::SetUp();
    if (network_) add_addresses();
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

  // Steps of the stories below.
  void send_whole_datagrams_with_ttl_one();
  void not_hear_its_group_on_another_interface();
  void join_again_when_the_interface_returns();
  void wait_for_an_address();
  void come_up_with_an_interface_that_is_late();
  void use_the_networks_broadcast_address();
  void be_down_without_the_address_of_its_broadcast_address();
  void use_the_broadcast_address_of_all_networks_without_a_route();
  void never_fragment_on_a_small_mtu();
};

void UdpWire::send_whole_datagrams_with_ttl_one() {
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

void UdpWire::not_hear_its_group_on_another_interface() {
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

void UdpWire::join_again_when_the_interface_returns() {
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

void UdpWire::wait_for_an_address() {
  network_->ip('a', "addr flush dev air0");
  open();
  EXPECT_EQ(a_->state(),
            "down: interface 'air0' has no IPv4 address yet (give it one, or wait for DHCP)");
  network_->ip('a', "addr add 10.83.84.1/24 brd + dev air0");
  ASSERT_TRUE(run_until(io_, [&] { return a_->is_up(); })) << a_->state();
  expect_exchange();
  network_->ip('a', "addr flush dev air0");
  EXPECT_TRUE(run_until(io_, [&] { return !a_->is_up(); })) << a_->state();
  network_->ip('a', "addr add 10.83.84.1/24 brd + dev air0");
  expect_exchange();
}

void UdpWire::come_up_with_an_interface_that_is_late() {
  const auto expect_state = [&](const std::string& begin) {
    EXPECT_TRUE(run_until(io_, [&] { return a_->state().find(begin) == 0; })) << a_->state();
    EXPECT_FALSE(a_->is_up());
  };
  for (const char* const address : {"239.255.83.84", "255.255.255.255", "10.83.84.255"}) {
    network_->ip('a', "link del air0");
    open([&](UdpConfig& config) { config.address = address; });
    EXPECT_EQ(a_->missing(), "udp '" + std::string(address) + ":21332': no interface 'air0'; " +
                                 "this machine has lo");
    expect_state("down: waiting for interface 'air0'; at the start this machine had lo ");
    network_->add_pair();
    expect_state("down: interface 'air0' has no IPv4 address yet");
    add_addresses();
    ASSERT_TRUE(run_until(io_, [&] { return a_->is_up() && b_->is_up(); })) << a_->state();
    expect_exchange();
  }
  network_->ip('a', "addr flush dev air0");
  open([](UdpConfig& config) { config.address = "10.83.84.255"; });
  expect_state("down: interface 'air0' has no IPv4 address yet");
  network_->ip('a', "addr add 10.83.85.1/24 brd + dev air0");
  expect_state("down: neither a multicast group nor a broadcast address of this machine");
  network_->ip('a', "addr add 10.83.84.1/24 brd + dev air0");
  ASSERT_TRUE(run_until(io_, [&] { return a_->is_up(); })) << a_->state();
  expect_exchange();
  network_->ip('a', "addr del 10.83.85.1/24 dev air0");
}

void UdpWire::use_the_networks_broadcast_address() {
  open([](UdpConfig& config) { config.address = "10.83.84.255"; });
  expect_exchange();
}

void UdpWire::be_down_without_the_address_of_its_broadcast_address() {
  network_->ip('a', "link add other0 type veth peer name other1");
  network_->ip('a', "addr add 10.9.9.1/24 brd + dev other0");
  for (const char* const end : {"other0", "other1"}) {
    network_->ip('a', std::string("link set ") + end + " up");
  }
  for (const char* const interface : {"air0", ""}) {
    SCOPED_TRACE(interface);
    open([&](UdpConfig& config) {
      config.address = "10.83.84.255";
      config.interface = interface;
    });
    expect_exchange();
    network_->ip('a', "addr flush dev air0");
    EXPECT_TRUE(run_until(io_, [&] { return !a_->is_up(); })) << a_->state();
    network_->ip('a', "addr add 10.83.84.1/24 brd + dev air0");
    EXPECT_TRUE(run_until(io_, [&] { return a_->is_up(); })) << a_->state();
    expect_exchange();
  }
  network_->ip('a', "link del other0");
}

void UdpWire::use_the_broadcast_address_of_all_networks_without_a_route() {
  // There is no route to 255.255.255.255: what is sent there leaves by the configured interface.
  open([](UdpConfig& config) { config.address = "255.255.255.255"; });
  expect_exchange();
  network_->ip('a', "link del air0");
  ASSERT_TRUE(run_until(io_, [&] { return !a_->is_up() && !b_->is_up(); })) << a_->state();
  network_->add_pair();
  add_addresses();
  ASSERT_TRUE(run_until(io_, [&] { return a_->is_up() && b_->is_up(); })) << a_->state();
  expect_exchange();
}

void UdpWire::never_fragment_on_a_small_mtu() {
  network_->ip('a', "link set air0 mtu 600");
  open([](UdpConfig& config) { config.max_packet_bytes = 200; });
  WireProbe probe(*network_, 'b');
  for (std::uint32_t i = 0; i < 10; ++i) user_a_.waiting.push_back(numbered_packet(i, 200));
  a_->wake();
  ASSERT_TRUE(run_until(io_, [&] { return user_b_.received.size() == 10; }));
  for (const Bytes& bytes : probe.heard()) EXPECT_LE(bytes.size(), 614U);
}

TEST_F(UdpWire, StaysOnItsNetworkAndFollowsItsInterface) {
  send_whole_datagrams_with_ttl_one();
  not_hear_its_group_on_another_interface();
  join_again_when_the_interface_returns();
  wait_for_an_address();
  come_up_with_an_interface_that_is_late();
  use_the_networks_broadcast_address();
  be_down_without_the_address_of_its_broadcast_address();
  use_the_broadcast_address_of_all_networks_without_a_route();
  never_fragment_on_a_small_mtu();
}

}  // namespace
}  // namespace swarmtalk::drivers
