"""Prints once a second which robots are within half a metre.

Every robot says that it is there, five times a second; who is farther away is not heard. A robot
that was not heard for a second is gone.
"""
import time

import swarmtalk

robot = swarmtalk.Client("near")
here = robot.advertise("here", queue=1, drop_oldest=True)  # only the newest counts
heard = robot.subscribe("here", within=0.5, known_distance_only=True)
last = {}  # robot: (when, distance)
told = 0
while True:
    sent = here.send("")
    if not sent:
        print("not sent: " + sent.text)
    message = heard.get(0.2)
    for message in ([message] if message else []) + heard.take():
        last[message.sender] = (time.time(), message.distance)
    if time.time() - told > 1:
        told = time.time()
        near = {number: distance for number, (when, distance) in last.items() if told - when < 1}
        print("robot %d: %s" % (robot.node_id, ", ".join(
            "%d at %.2f m" % each for each in sorted(near.items())) or "nobody is near"))
