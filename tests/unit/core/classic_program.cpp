// A program as people wrote them for the 2020 release: globals, C casts, free setup() and loop().
#include "core/classic/swarmtalk.h"

typedef struct custom_message {
  int hop;
} custom_message_t;

Channel* channel;
Publisher* publisher;
Subscriber* subscriber;
custom_message_t my_message;
int received_count = 0;
int received_delay = 0;

void sent() {
  publisher->send((unsigned char*)&my_message, sizeof(my_message));
}

void recv(unsigned char* msg, int, int, Meta_t* meta) {
  custom_message_t* received = (custom_message_t*)msg;
  if (received->hop + 1 < my_message.hop) my_message.hop = received->hop + 1;
  received_delay = meta->msg_delay;
  ++received_count;
}

void loop() {
  if (LED_control->current_status() == Off) LED_control->turn_on(my_message.hop & 1, 0, 1, 20);
  if (motor_control->current_status() == Stop) motor_control->turn_left(10);
}

void setup() {
  my_message.hop = 100;
  channel = swarmtalk.new_channel(0, 0, false);
  publisher = channel->new_publisher(sent);
  subscriber = channel->new_subscriber(250, recv);
  publisher->send((unsigned char*)&my_message, sizeof(my_message));
}
