// Drives a 2020 program the way its driver did: init, setup, execute_loop, next_pkt, receive.
#include <gtest/gtest.h>

#include "tests/unit/core/classic_program.cpp"  // NOLINT: the program is one with its driver

namespace {

unsigned int ticks = 0;
int led_red = -1;
int motor_state_now = -1;

TEST(Classic, RunsA2020ProgramUnchanged) {
  swarmtalk.sys.set_common_sys_get_clock([]() { return ticks; });
  swarmtalk.led.set_driver([](int red, int, int) { led_red = red; }, [] { return ticks; });
  swarmtalk.motor.set_driver([](int state) { motor_state_now = state; }, [] { return ticks; });
  swarmtalk.init();
  setup();
  swarmtalk.register_user_loop(loop);
  swarmtalk.execute_loop();
  EXPECT_EQ(motor_state_now, Turn_left);
  EXPECT_EQ(LED_control->current_status(), On);
  EXPECT_EQ(led_red, 0);

  // A second instance in the same process: the neighbour, who is the seed.
  SwarmTalk::Swarmtalk seed;
  seed.sys.set_common_sys_get_clock([]() { return ticks; });
  seed.sys.set_common_sys_random_func([]() { return 77u; });
  Publisher* seed_publisher = seed.new_channel(0, 0, false)->new_publisher(nullptr);
  custom_message_t zero = {0};
  EXPECT_EQ(seed_publisher->send((unsigned char*)&zero, sizeof(zero)), 0);
  EXPECT_EQ(seed_publisher->send((unsigned char*)&zero, sizeof(zero)), 1);
  EXPECT_EQ(seed_publisher->send((unsigned char*)&zero, 1000), 2);
  unsigned char packet[PKT_SIZE];
  ASSERT_EQ(seed.next_pkt(packet), PKT_SIZE);
  EXPECT_EQ(seed.next_pkt(packet + 0), 0);
  Meta_t far_away = {300, 0};
  swarmtalk.receive(packet, PKT_SIZE, &far_away);
  EXPECT_EQ(received_count, 0);
  Meta_t near_by = {50, 0};
  ticks += 100;
  seed_publisher->send((unsigned char*)&zero, sizeof(zero));
  seed.next_pkt(packet);
  swarmtalk.receive(packet, PKT_SIZE, &near_by);
  EXPECT_EQ(received_count, 1);
  EXPECT_EQ(my_message.hop, 1);
  swarmtalk.execute_loop();
  swarmtalk.execute_loop();
  EXPECT_EQ(led_red, 1);
}

TEST(Classic, RefusesWhat2020Refused) {
  SwarmTalk::Swarmtalk node;
  EXPECT_EQ(node.new_channel(-1, 0, false), nullptr);
  EXPECT_EQ(node.new_channel(CHAN_TYPE_MAX + 1, 0, false), nullptr);
  Channel* first = node.new_channel(1, 0, true);
  ASSERT_NE(first, nullptr);
  ASSERT_NE(node.new_channel(2, 0, false), nullptr);
  EXPECT_EQ(node.new_channel(3, 0, false), nullptr);
  EXPECT_NE(first->new_publisher(nullptr), nullptr);
  EXPECT_EQ(first->new_publisher(nullptr), nullptr);
  unsigned char byte = 0;
  EXPECT_EQ(first->new_subscriber(1, nullptr) != nullptr, true);
  node.receive(&byte, 1, nullptr);
  node.receive(&byte, -1, nullptr);
}

}  // namespace
