/* A robot program in C that looks around: tells its pose and a value, waits for the answers of
 * another robot and prints what it finds, a line each. Arguments: X Y ANSWERS. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <swarmtalk/swarmtalk.h>

static void print_neighbour(const swarmtalk_neighbour* neighbour, void* context) {
  ++*(int*)context;
  printf("neighbour %u by %s at %s, %.2f m, pose %.2f %.2f, %s, frames %s\n", neighbour->node_id,
         neighbour->link, neighbour->address[0] != 0 ? "an address" : "none",
         (double)neighbour->distance_m, (double)neighbour->pose.x_m, (double)neighbour->pose.y_m,
         neighbour->duplicate_id ? "twice" : "once", neighbour->frames > 0 ? "some" : "none");
}

static void print_value(const swarmtalk_value* value, void* context) {
  ++*(int*)context;
  printf("value of %u: %s = %.*s, %s\n", value->node_id, value->key, (int)value->value_bytes,
         value->value, value->local ? "local" : "remote");
}

static int fail(swarmtalk_client* robot, const char* what) {
  printf("%s: %s\n", what, swarmtalk_error(robot));
  return 1;
}

/* What goes wrong is answered, not crashed on. */
static int check_mistakes(swarmtalk_client* robot, swarmtalk_harvest* harvest) {
  if (swarmtalk_neighbours(robot, NULL, NULL) != SWARMTALK_BAD_ARGUMENT) return 1;
  if (swarmtalk_get_pose(robot, NULL) != SWARMTALK_BAD_ARGUMENT) return 1;
  if (swarmtalk_log(robot, NULL) != SWARMTALK_BAD_ARGUMENT) return 1;
  if (swarmtalk_harvest_set(harvest, NULL, "1") != SWARMTALK_BAD_ARGUMENT) return 1;
  if (swarmtalk_harvest_set(harvest, "", "1") != SWARMTALK_BAD_ARGUMENT) return 1;
  swarmtalk_status no_pose = swarmtalk_set_fixed_pose(robot, NAN, 0, 0);
  if (no_pose == SWARMTALK_OK) no_pose = swarmtalk_sync(robot);
  return no_pose == SWARMTALK_BAD_POSE ? 0 : 1;
}

static int look_around(swarmtalk_client* robot, swarmtalk_harvest* harvest, char** words) {
  swarmtalk_pose pose;
  if (swarmtalk_get_pose(robot, &pose) != SWARMTALK_OK) return fail(robot, "get_pose");
  printf("pose %s\n", isnan(pose.x_m) ? "unknown" : "known");
  if (check_mistakes(robot, harvest) != 0) return fail(robot, "a mistake was accepted");
  swarmtalk_set_fixed_pose(robot, strtof(words[0], NULL), strtof(words[1], NULL), 0);
  if (swarmtalk_get_pose(robot, &pose) != SWARMTALK_OK) return fail(robot, "get_pose");
  printf("pose %.2f %.2f\n", (double)pose.x_m, (double)pose.y_m);
  if (swarmtalk_harvest_set(harvest, "c", "yes") != SWARMTALK_OK) return fail(robot, "set");
  if (swarmtalk_harvest_set(harvest, "gone", "1") != SWARMTALK_OK) return fail(robot, "set");
  if (swarmtalk_harvest_set(harvest, "gone", NULL) != SWARMTALK_OK) return fail(robot, "remove");
  int answers = 0;
  if (swarmtalk_harvest_ask(harvest, "", 4, print_value, &answers) != SWARMTALK_OK) {
    return fail(robot, "ask");
  }
  for (int i = 0; i < 100 && answers < atoi(words[2]); ++i) swarmtalk_run_for(robot, 100);
  int neighbours = 0;
  if (swarmtalk_neighbours(robot, print_neighbour, &neighbours) != SWARMTALK_OK) {
    return fail(robot, "neighbours");
  }
  printf("%d neighbours\n", neighbours);
  return 0;
}

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  swarmtalk_client* robot = swarmtalk_open("c_robot", NULL);
  if (swarmtalk_connect(robot) != SWARMTALK_OK) return fail(robot, "connect");
  swarmtalk_harvest* harvest = swarmtalk_harvest_open(robot);
  if (swarmtalk_harvest_status(harvest) != SWARMTALK_OK) return fail(robot, "harvest");
  const int code = look_around(robot, harvest, argv + 1);
  swarmtalk_harvest_close(harvest);
  swarmtalk_close(robot);
  return code;
}
