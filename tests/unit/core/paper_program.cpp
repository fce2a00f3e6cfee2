// The listing of Zhang et al., AAMAS 2020, sec. 2.3, as printed but for the output.
#include "core/classic/paper.h"

typedef struct state {
  uint64_t random_id;
  uint64_t clock;
} state_t;

Channel* channel;
Publisher* publisher;
Subscriber* subscriber;
state_t my_state;
state_t heard_state;
int heard_distance = 0;

void sent() {
  // update the clock
  my_state.clock = get_clock();
  // send the updated message again
  publisher->send((unsigned char*)&my_state, sizeof(my_state));
}

void recv(unsigned char* msg, int, int, Data_t* sensing) {
  // Deserialize the message
  state_t* recv_state = (state_t*)msg;
  heard_state = *recv_state;
  heard_distance = sensing->dist;
}

void setup() {
  my_state.random_id = 0x1122334455667788;
  my_state.clock = get_clock();
  channel = swarmtalk->new_channel(0, 0, false);
  publisher = channel->new_publisher(sent);
  subscriber = channel->new_subscriber(100, recv);
  publisher->send((unsigned char*)&my_state, sizeof(my_state));
}

void loop() {}
