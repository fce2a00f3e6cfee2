/* Sends COUNT messages in a row, as somebody does who never looks at the answer. Arguments: COUNT,
 * and what comes then: "wait" or "no-queue" runs for a while, "close" closes, "leave" just ends.
 * "wait" after that: says that it is ready, and waits for a line before it sends. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <swarmtalk/swarmtalk.h>

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  swarmtalk_client* robot = swarmtalk_open("two_sends", NULL);
  if (swarmtalk_connect(robot) != SWARMTALK_OK) {
    fprintf(stderr, "%s\n", swarmtalk_error(robot));
    return 1;
  }
  swarmtalk_sending sending = {0};
  if (strcmp(argv[2], "no-queue") == 0) sending.queue = SWARMTALK_NO_QUEUE;
  swarmtalk_publisher* publisher = swarmtalk_advertise(robot, "two", &sending, NULL, NULL);
  if (argc > 3) {
    printf("ready\n");
    fflush(stdout);
    getchar();
  }
  int refused = 0;
  for (int i = 0; i < atoi(argv[1]); ++i) {
    char text[16];
    snprintf(text, sizeof text, "%d", i);
    if (swarmtalk_send(publisher, text, strlen(text)) == SWARMTALK_BUSY) ++refused;
  }
  printf("%d refused\n", refused);
  if (strcmp(argv[2], "leave") == 0) return 0;
  if (strcmp(argv[2], "close") != 0) swarmtalk_run_for(robot, 300);
  swarmtalk_unadvertise(publisher);
  swarmtalk_close(robot);
  return 0;
}
