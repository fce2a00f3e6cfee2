#!/usr/bin/python3
"""benchmarks/latency.cpp in Python: the same program, for python_cost.py."""
import json
import pathlib
import resource
import struct
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "client_lib/python"))
import swarmtalk  # noqa: E402

GIVE_UP_S = 10


def cpu_us():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return (usage.ru_utime + usage.ru_stime) * 1e6


def quantile(values, share):
    return sorted(values)[int(share * (len(values) - 1))] if values else 0.0


def receive(count):
    robot = swarmtalk.Client("latency")
    latencies_us = []

    def heard(message):
        sent_ns, = struct.unpack_from("<q", message.data)
        latencies_us.append((time.monotonic_ns() - sent_ns) / 1000)
        if len(latencies_us) == count:
            robot.stop()
    robot.subscribe("latency", heard)
    print("ready", file=sys.stderr, flush=True)
    before_us, seen, last_progress = cpu_us(), 0, time.monotonic()
    while len(latencies_us) < count and time.monotonic() - last_progress < GIVE_UP_S:
        robot.run(0.2)
        if len(latencies_us) != seen:
            seen, last_progress = len(latencies_us), time.monotonic()
    print(json.dumps({"received": len(latencies_us), "p50_us": quantile(latencies_us, 0.5),
                      "p99_us": quantile(latencies_us, 0.99),
                      "cpu_us": (cpu_us() - before_us) / max(len(latencies_us), 1)}))
    return 0 if len(latencies_us) == count else 1


def send(count, size_bytes, gap_us, burst=1):
    robot = swarmtalk.Client("latency")
    publisher = robot.advertise("latency", queue=0 if burst == 1 else 2 * burst)
    rest = b"x" * (size_bytes - 8)
    busy, before_us, following = 0, cpu_us(), time.monotonic()
    for i in range(count):
        if i % burst == 0:
            following += gap_us * 1e-6
            time.sleep(max(following - time.monotonic(), 0))
            robot.process()
        while publisher.busy():
            busy += 1
            robot.run_once(0.001)
        if not publisher.send(struct.pack("<q", time.monotonic_ns()) + rest):
            sys.exit("latency_app.py: refused")
    while publisher.busy():
        robot.run_once(0.01)
    robot.run(0 if burst == 1 else 1)  # what waits in the daemon leaves before we go
    print(json.dumps({"sent": count, "waited_for_busy": busy,
                      "cpu_us": (cpu_us() - before_us) / count}))
    return 0


if __name__ == "__main__":
    sys.exit({"receive": receive, "send": send}[sys.argv[1]](*map(int, sys.argv[2:])))
