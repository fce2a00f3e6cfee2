// A RawL2Link lives through all that can happen to its interface, with one and the same socket and,
// once opened, without any capability.
#include <cap-ng.h>
#include <gtest/gtest.h>

#include <future>

#include "drivers/socket/raw_l2.hpp"
#include "tests/unit/drivers/test_network.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

class RawL2Changes : public LinkPair<RawL2Link, RawL2Config> {
 protected:
  void SetUp() override {
    LinkPair::SetUp();
    if (!network_) return;
    open();
    expect_exchange();
  }

  /// A packet of `size` bytes from each reaches the other. Repeated every 50 ms: one that leaves
  /// before the other end has followed its interface is lost, as on any wire.
  void expect_exchange(std::size_t size = 100) {
    const std::size_t a_had = user_a_.received.size();
    const std::size_t b_had = user_b_.received.size();
    MonotonicTime next_at{};
    ASSERT_TRUE(run_until(io_,
                          [&] {
                            const MonotonicTime now = std::chrono::steady_clock::now();
                            if (a_->is_up() && b_->is_up() && now >= next_at) {
                              next_at = now + 50ms;
                              user_a_.waiting.push_back(numbered_packet(7, size));
                              user_b_.waiting.push_back(numbered_packet(7, size));
                              a_->wake();
                              b_->wake();
                            }
                            return user_a_.received.size() > a_had &&
                                   user_b_.received.size() > b_had;
                          }))
        << "a: " << a_->state() << "; b: " << b_->state();
    EXPECT_EQ(user_a_.received.back(), numbered_packet(7, size));
    EXPECT_EQ(user_b_.received.back(), numbered_packet(7, size));
  }

  void expect_state_of_a(const std::string& words, bool is_up) {
    EXPECT_TRUE(run_until(io_, [&] {
      return a_->state().find(words) != std::string::npos && a_->is_up() == is_up;
    })) << a_->state();
  }

  /// Capabilities belong to a thread: one gives up all it has and runs the links, while the main
  /// thread, still root, plays with the interface.
  static void give_up_capabilities() {
    capng_clear(CAPNG_SELECT_BOTH);
    if (capng_apply(CAPNG_SELECT_CAPS) != 0) std::abort();
    EXPECT_EQ(socket(AF_PACKET, SOCK_RAW, 0), -1) << "still has CAP_NET_RAW";
  }

  // Steps of the stories below.
  void survive_down_and_up();
  void notice_that_the_other_end_is_down();
  void be_down_as_a_port_of_a_bridge();
  void go_on_while_dormant();
  void pull_nothing_while_down();
  void survive_deletion_and_return();
  void survive_deletion_and_return_before_it_is_noticed();
  void need_no_capability();
  void come_up_with_an_interface_that_is_late();
  void follow_the_mtu();
  void say_what_an_mtu_is_too_small_for();
  void follow_a_renamed_interface();
  void prefer_another_interface_of_its_name_to_the_renamed_one();
};

void RawL2Changes::survive_down_and_up() {
  network_->ip('a', "link set air0 down");
  expect_state_of_a("'air0' is switched off (ip link set air0 up)", false);
  EXPECT_EQ(counter(*a_, "link_down_events"), 1U);
  network_->ip('a', "link set air0 up");
  expect_state_of_a("up, MTU 1500 bytes", true);
  expect_exchange();
}

void RawL2Changes::notice_that_the_other_end_is_down() {
  network_->ip('b', "link set air0 down");
  expect_state_of_a("has no carrier (plug in its cable, or join its Wi-Fi)", false);
  network_->ip('b', "link set air0 up");
  expect_exchange();
}

void RawL2Changes::be_down_as_a_port_of_a_bridge() {
  network_->ip('a', "link add name br0 type bridge");
  network_->ip('a', "link set air0 master br0");
  expect_state_of_a("is a port of br0, which takes all its frames (set interface = \"br0\")",
                    false);
  network_->ip('a', "link del br0");
  expect_exchange();
}

void RawL2Changes::go_on_while_dormant() {
  network_->ip('a', "link set air0 mode dormant");
  network_->ip('a', "link set air0 down");
  network_->ip('a', "link set air0 up");
  expect_state_of_a("dormant: no supplicant has authorised it", true);
  expect_exchange();
  network_->ip('a', "link set air0 mode default state up");
  EXPECT_TRUE(run_until(io_, [&] { return a_->state() == "up, MTU 1500 bytes"; })) << a_->state();
}

void RawL2Changes::pull_nothing_while_down() {
  network_->ip('a', "link set air0 down");
  expect_state_of_a("switched off", false);
  user_a_.waiting.push_back(numbered_packet(77, 50));
  a_->wake();
  run_for(io_, 50ms);
  EXPECT_EQ(user_a_.waiting.size(), 1U) << "the newest leaves when the link is back, not this";
  const std::size_t had = user_b_.received.size();
  network_->ip('a', "link set air0 up");
  EXPECT_TRUE(run_until(io_, [&] { return user_b_.received.size() > had; }))
      << "sent without another wake";
}

void RawL2Changes::survive_deletion_and_return() {
  const std::uint64_t had = counter(*a_, "link_down_events");
  for (int round = 0; round < 3; ++round) {
    network_->ip('a', "link del air0");
    expect_state_of_a("interface 'air0' is gone (ip link lists those there are)", false);
    run_for(io_, 20ms);
    network_->add_pair();
    expect_exchange();
  }
  EXPECT_EQ(counter(*a_, "link_down_events") - had, 3U);
}

void RawL2Changes::survive_deletion_and_return_before_it_is_noticed() {
  network_->ip('a', "link del air0");
  network_->add_pair();
  expect_exchange();
}

void RawL2Changes::need_no_capability() {
  std::promise<void> runs, is_down;
  std::thread daemon([&] {
    give_up_capabilities();
    runs.set_value();
    EXPECT_TRUE(run_until(io_, [&] { return !a_->is_up(); }));
    is_down.set_value();
    EXPECT_TRUE(run_until(io_, [&] { return a_->is_up() && b_->is_up(); }));
    expect_exchange();
  });
  runs.get_future().wait();
  network_->ip('a', "link del air0");
  is_down.get_future().wait();
  network_->add_pair();
  daemon.join();
}

void RawL2Changes::come_up_with_an_interface_that_is_late() {
  network_->ip('a', "link del air0");
  open();
  const std::string waiting =
      "down: waiting for interface 'air0'; at the start this machine had lo (ip link lists those "
      "there "
      "are)";
  EXPECT_EQ(a_->state(), waiting);
  EXPECT_EQ(a_->missing(), "raw_l2 'air0': no such interface; this machine has lo");
  network_->ip('a', "tuntap add dev air0 mode tun");
  expect_state_of_a("interface 'air0' is not an Ethernet or Wi-Fi interface", false);
  network_->ip('a', "link del air0");
  expect_state_of_a(waiting, false);
  std::promise<void> runs;
  std::thread daemon([&] {
    give_up_capabilities();
    runs.set_value();
    expect_exchange();
  });
  runs.get_future().wait();
  network_->add_pair();
  daemon.join();
  EXPECT_EQ(counter(*a_, "link_down_events"), 0U) << "it was not up before";
  network_->ip('a', "link del air0");
  expect_state_of_a("interface 'air0' is gone", false);
  network_->add_pair();
  expect_exchange();
}

void RawL2Changes::follow_the_mtu() {
  for (const int mtu : {9000, 1500, 1427}) {
    for (const char side : {'a', 'b'}) {
      network_->ip(side, "link set air0 mtu " + std::to_string(mtu));
    }
    expect_state_of_a("up, MTU " + std::to_string(mtu) + " bytes", true);
    for (std::uint32_t i = 0; i < 20; ++i) user_a_.waiting.push_back(numbered_packet(i, 1400));
    const std::uint64_t had = counter(*a_, "frames_sent");
    const std::size_t b_had = user_b_.received.size();
    a_->wake();
    ASSERT_TRUE(run_until(io_, [&] { return user_b_.received.size() == b_had + 20; }));
    EXPECT_EQ(counter(*a_, "frames_sent") - had, 20U) << "others may take 1500 bytes only";
  }
  EXPECT_EQ(counter(*b_, "frames_truncated"), 0U);
  for (const char side : {'a', 'b'}) network_->ip(side, "link set air0 mtu 1500");
}

void RawL2Changes::say_what_an_mtu_is_too_small_for() {
  user_a_.header.pose = frame::FramePose{0, 0, 0, 0};
  network_->ip('a', "link set air0 mtu 300");
  expect_state_of_a("up, MTU 300 bytes, too small: packets of more than 273 bytes are dropped",
                    true);
  user_a_.waiting.push_back(numbered_packet(1, 274));
  user_a_.waiting.push_back(numbered_packet(2, 273));
  const std::size_t had = user_b_.received.size();
  a_->wake();
  ASSERT_TRUE(run_until(io_, [&] { return user_b_.received.size() > had; }));
  EXPECT_EQ(user_b_.received.back(), numbered_packet(2, 273));
  EXPECT_EQ(counter(*a_, "packets_over_mtu"), 1U);
  network_->ip('a', "link set air0 mtu 1500");
  expect_state_of_a("up, MTU 1500 bytes", true);
  expect_exchange(1400);
}

void RawL2Changes::follow_a_renamed_interface() {
  network_->ip('a', "link set air0 down");
  network_->ip('a', "link set air0 name radio0");
  network_->ip('a', "link set radio0 up");
  expect_state_of_a("up (renamed to 'radio0')", true);
  expect_exchange();
  network_->ip('a', "link set radio0 down");
  network_->ip('a', "link set radio0 name air0");
  network_->ip('a', "link set air0 up");
  expect_state_of_a("up, MTU", true);
  expect_exchange();
}

void RawL2Changes::prefer_another_interface_of_its_name_to_the_renamed_one() {
  network_->ip('a', "link set air0 down");
  network_->ip('a', "link set air0 name old0");
  expect_state_of_a("renamed to 'old0'", false);
  network_->ip('b', "link set air0 down");
  network_->ip('b', "link set air0 name old0");
  network_->add_pair();
  expect_exchange();
  expect_state_of_a("up, MTU", true);
}

TEST_F(RawL2Changes, LivesThroughDownsDeletionsAndTheLossOfItsCapabilities) {
  survive_down_and_up();
  notice_that_the_other_end_is_down();
  be_down_as_a_port_of_a_bridge();
  go_on_while_dormant();
  pull_nothing_while_down();
  survive_deletion_and_return();
  survive_deletion_and_return_before_it_is_noticed();
  need_no_capability();
  come_up_with_an_interface_that_is_late();
}

TEST_F(RawL2Changes, FollowsTheNameAndTheMtu) {
  follow_the_mtu();
  say_what_an_mtu_is_too_small_for();
  follow_a_renamed_interface();
  prefer_another_interface_of_its_name_to_the_renamed_one();
}

}  // namespace
}  // namespace swarmtalk::drivers
