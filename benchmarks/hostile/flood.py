"""A flood of messages with the largest TTL into robots with a low rate."""
import time

from stranger import Air, counter

ROBOTS = 6
TITLE = f"1.2 MB in 10 s with TTL 255 into {ROBOTS} robots at 3 frames/s (reference: 40)"
REFERENCE = "more than 4 minutes at their rate limit"
LONGEST_S = 300


def measure():
    with Air() as air:
        robots = [air.daemon(number, "rate_hz = 3\n") for number in range(1, ROBOTS + 1)]
        air.attack("flood", "--channel", 5, "--rate", 86, "--seconds", 10)
        ended, last = time.monotonic(), None
        quiet_since = ended
        while time.monotonic() - quiet_since < 3 and time.monotonic() - ended < LONGEST_S:
            sent = [counter(robot, "node_packets_forwarded") for robot in robots]
            if sent != last:
                quiet_since, last = time.monotonic(), sent
            time.sleep(0.5)
        return f"quiet {quiet_since - ended:.0f} s after its end"
