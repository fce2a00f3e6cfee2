"""Writes every message of some channels to a CSV file: log_to_csv.py FILE CHANNEL...

Times are seconds since 1970, so that the files of several robots can be put side by side. An empty
cell is unknown.
"""
import binascii
import csv
import sys
import time

import swarmtalk

if len(sys.argv) < 3:
    sys.exit(__doc__)
robot = swarmtalk.Client("log_to_csv")
file = open(sys.argv[1], "w")
table = csv.writer(file)
table.writerow(["time", "channel", "sender", "number", "distance_m", "bearing_rad", "hops", "lost",
                "hex"])


def writer(channel):
    def receive(message):
        table.writerow([
            "%.6f" % (time.time() - message.age), channel, message.sender, message.message_number,
            "%.3f" % message.distance if message.has_distance else "",
            "%.3f" % message.bearing if message.has_bearing else "",
            message.hops, message.lost_before.total, binascii.hexlify(message.data).decode()])
        file.flush()
    return receive


for name in sys.argv[2:]:
    robot.subscribe(name, writer(name))
print("writing %s to %s until Ctrl-C" % (", ".join(sys.argv[2:]), sys.argv[1]))
try:
    robot.run()
except KeyboardInterrupt:
    pass
