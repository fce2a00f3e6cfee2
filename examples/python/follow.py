"""Follows the nearest robot: turns towards it, drives, and stops 20 cm before it.

drive() prints; put your robot's motors there.
"""
import math

import swarmtalk


def drive(left, right):
    print("left %.0f, right %.0f" % (left, right))


robot = swarmtalk.Client("follow")
here = robot.advertise("here", queue=1, drop_oldest=True)
heard = robot.subscribe("here", latest_from_each=True, known_distance_only=True,
                        no_older_than=1.0)
while True:
    sent = here.send("")
    if not sent:
        print("not sent: " + sent.text)
    robot.run(0.1)
    others = [message for message in heard.take() if message.has_bearing]
    if not others:
        continue
    nearest = min(others, key=lambda message: message.distance)
    print("robot %d is nearest, %.2f m away at %.0f degrees" % (
        nearest.sender, nearest.distance, math.degrees(nearest.bearing)))
    if nearest.distance < 0.2:
        drive(0, 0)
    else:
        turn = 30 * nearest.bearing / math.pi  # counter-clockwise: the right wheel goes faster
        drive(20 - turn, 20 + turn)
