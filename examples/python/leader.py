"""The robot with the highest number leads; when it falls silent, the next one does.

Everyone tells the highest number it knows, over up to three more robots.
"""
import struct
import time

import swarmtalk

SILENCE_S = 2
robot = swarmtalk.Client("leader")
claims = robot.advertise("leader", ttl=3, queue=1, drop_oldest=True)
heard = robot.subscribe("leader", latest_from_each=True)
last = {}  # robot: when it was heard
leader = None
while True:
    sent = claims.send(struct.pack("<I", robot.node_id))
    if not sent:
        print("not sent: " + sent.text)
    robot.run(0.25)
    for message in heard.take():
        if len(message.data) == 4:
            last[struct.unpack("<I", message.data)[0]] = time.time()
    alive = [number for number, when in last.items() if time.time() - when < SILENCE_S]
    now = max(alive + [robot.node_id])
    if now != leader:
        leader = now
        print("robot %d: %s" % (robot.node_id, "I lead" if leader == robot.node_id
                                else "robot %d leads" % leader))
