#include <gtest/gtest.h>

#include "tests/unit/core/paper_program.cpp"  // NOLINT: the program is one with its driver

namespace {

TEST(PaperNames, RunTheListingOfThePaper) {
  setup();
  loop();
  SwarmTalk::Swarmtalk other;
  Publisher* other_publisher = other.new_channel(0, 0, false)->new_publisher(nullptr);
  state_t state = {42, 43};
  other_publisher->send((unsigned char*)&state, sizeof(state));
  unsigned char packet[PKT_SIZE];
  Data_t sensing = {60, 0};
  while (other.next_pkt(packet) != 0) swarmtalk->receive(packet, PKT_SIZE, &sensing);
  EXPECT_EQ(heard_state.random_id, 42u);
  EXPECT_EQ(heard_state.clock, 43u);
  EXPECT_EQ(heard_distance, 60);
  for (int i = 0; i < 9; ++i)
    EXPECT_EQ(swarmtalk->next_pkt(packet), 9);  // it sends again and again
}

}  // namespace
