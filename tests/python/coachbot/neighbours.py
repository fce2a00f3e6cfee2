# Tells its position, and prints all others it has heard of. In the style of many Coachbot scripts:
# position and number packed by hand, the received bytes cut to length.
import struct
import math


def usr(robot):
    robot.set_vel(20, 20)
    robot.delay(150)  # wakes the localisation
    robot.set_vel(0, 0)
    pose_t = robot.get_pose()
    while not pose_t:
        pose_t = robot.get_pose()
    heard = {}
    complete_at = None
    while robot.get_clock() < 40:
        pose_t = robot.get_pose()
        if pose_t:
            robot.send_msg(struct.pack('ffi', pose_t[0], pose_t[1], robot.virtual_id()))
        robot.delay(50)
        msgs = robot.recv_msg()
        if len(msgs) > 0:
            for i in range(len(msgs)):
                (x, y, number) = struct.unpack('ffi', msgs[i][:12])
                heard[number] = math.sqrt((x - pose_t[0]) ** 2 + (y - pose_t[1]) ** 2)
        if len(heard) == 8 and complete_at is None:
            complete_at = robot.get_clock()
        if complete_at is not None and robot.get_clock() > complete_at + 2:
            break
    robot.set_led(0, 100, 0)
    nearest = min(heard.values())
    print("%d heard %d robots, the nearest %.2f m away" % (robot.virtual_id(), len(heard), nearest))
