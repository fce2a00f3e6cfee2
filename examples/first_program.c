/* The first robot program in C: says hello twice a second and prints what it hears. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <swarmtalk/swarmtalk.h>

static void heard(const swarmtalk_message* message, void* context) {
  (void)context;
  printf("robot %u says %.*s", message->sender, (int)message->payload_bytes,
         (const char*)message->payload);
  if (!isnan(message->distance_m)) printf(", %.2f m away", (double)message->distance_m);
  printf("\n");
  fflush(stdout);
}

int main(void) {
  swarmtalk_client* robot = swarmtalk_open("first_program_c", NULL);
  if (robot == NULL) return 1;
  if (swarmtalk_connect(robot) != SWARMTALK_OK) {
    fprintf(stderr, "%s\n", swarmtalk_error(robot));
    swarmtalk_close(robot);
    return 1;
  }
  swarmtalk_publisher* hello = swarmtalk_advertise(robot, "hello", NULL, NULL, NULL);
  swarmtalk_subscriber* others = swarmtalk_subscribe(robot, "hello", NULL, heard, NULL);
  for (int i = 1; i <= 10; ++i) {
    char text[32];
    snprintf(text, sizeof text, "hello %d", i);
    const swarmtalk_status sent = swarmtalk_send(hello, text, strlen(text));
    if (sent != SWARMTALK_OK) fprintf(stderr, "not sent: %s\n", swarmtalk_status_text(sent));
    swarmtalk_run_for(robot, 500);
  }
  swarmtalk_unsubscribe(others);
  swarmtalk_unadvertise(hello);
  swarmtalk_close(robot);
  return 0;
}
