// flooding.hpp as an image.
#include "tests/kilobot/images/flooding.hpp"

#include "platforms/kilobot/join.hpp"

volatile uint16_t flooding_sent;
volatile uint16_t flooding_heard;
volatile uint16_t flooding_first;
volatile uint16_t flooding_twice;
volatile uint16_t flooding_own_back;
volatile uint8_t flooding_node_id;
volatile uint8_t flooding_id_changes;

swarmtalk::kilobot::Joined<swarmtalk::kilobot::Flooding> joined(swarmtalk::kilobot::read_uid());

int main() {
  joined.run();
}
