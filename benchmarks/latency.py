#!/usr/bin/python3
"""Latency and CPU from program to program, beside bare packet sockets on the same wire.

usage: benchmarks/latency.py [--build build-test] [--pairs 5] [--count 2000] [--bytes 64]
                             [--gap-us 500]

Starts a lab of two robots (root) and runs, in turn, a bare AF_PACKET sender and receiver and two
programs on the client library with the lab's daemons between them. Prints medians over the pairs
and the ratio. CPU is that of all processes on the way, per message. The daemons' share is read from
/proc/PID/schedstat, so the kernel's work on their behalf counts as theirs.
"""
import argparse
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
TIMEOUT_S = 120


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--count", type=int, default=2000, help="messages in each run")
    parser.add_argument("--bytes", type=int, default=64)
    parser.add_argument("--gap-us", type=int, default=500)
    return parser.parse_args()


class Lab:
    def __init__(self, build):
        self.tool = [str(build / "lab/swarmtalk-lab"), "--name", f"latency{os.getpid()}"]
        subprocess.run([*self.tool, "up", "2", "--config", ROOT / "tests/support/bare.toml"],
                       check=True, timeout=TIMEOUT_S, stdout=subprocess.DEVNULL)
        done = subprocess.run([*self.tool, "status", "--json"], check=True, text=True,
                              timeout=TIMEOUT_S, capture_output=True)
        self.daemons = [json.loads(line)["pid"] for line in done.stdout.splitlines()]

    def start(self, robot, *command):
        return subprocess.Popen([*self.tool, "exec", str(robot), "--", *map(str, command)],
                                text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def daemon_cpu_us(self):
        total_ns = 0
        for pid in self.daemons:
            total_ns += int(pathlib.Path(f"/proc/{pid}/schedstat").read_text().split()[0])
        return total_ns / 1000

    def down(self):
        subprocess.run([*self.tool, "down"], check=True, timeout=TIMEOUT_S)


def one_run(lab, receive, send, count):
    """Runs one receiver and one sender; returns p50 and p99 (us) and CPU per message (us)."""
    before_us = lab.daemon_cpu_us()
    receiver = lab.start(2, *receive)
    line = receiver.stderr.readline()
    if "ready" not in line:
        sys.exit(f"latency.py: the receiver says: {line.strip()}")
    sender = lab.start(1, *send)
    sent, errors = sender.communicate(timeout=TIMEOUT_S)
    if sender.returncode != 0:
        sys.exit(f"latency.py: the sender says: {errors.strip()}")
    received, _ = receiver.communicate(timeout=TIMEOUT_S)
    got, gave = json.loads(received), json.loads(sent)
    return {"p50_us": got["p50_us"], "p99_us": got["p99_us"], "lost": count - got["received"],
            "cpu_us": got["cpu_us"] + gave["cpu_us"] + (lab.daemon_cpu_us() - before_us) / count}


def commit():
    done = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], text=True,
                          capture_output=True)
    return done.stdout.strip() or "unknown"


def main():
    options = parse()
    if os.geteuid() != 0:
        sys.exit("latency.py: network namespaces need root")
    floor = options.build / "benchmarks/l2_floor/l2_floor"
    app = options.build / "benchmarks/latency"
    lab = Lab(options.build)
    runs = {"bare": [], "swarmtalkd": []}
    try:
        for _ in range(options.pairs):
            runs["bare"].append(one_run(
                lab, [floor, "receive", "wlan0", options.count],
                [floor, "send", "wlan0", options.count, options.bytes, options.gap_us],
                options.count))
            runs["swarmtalkd"].append(one_run(
                lab, [app, "receive", options.count],
                [app, "send", options.count, options.bytes, options.gap_us], options.count))
    finally:
        lab.down()

    print(f"{options.bytes} B every {options.gap_us} us, {options.count} messages a run, median "
          f"(lowest to highest) of {options.pairs} interleaved pairs")
    print(f"commit {commit()}, {os.cpu_count()} cores, Linux {platform.release()}\n")
    print(f"{'':24}{'p50 us':>22}{'p99 us':>24}{'CPU us/message':>22}{'lost':>6}")
    medians = {}
    for name, results in runs.items():
        cells = ""
        for key, width in (("p50_us", 22), ("p99_us", 24), ("cpu_us", 22)):
            values = [result[key] for result in results]
            medians[name, key] = statistics.median(values)
            text = f"{medians[name, key]:.1f} ({min(values):.1f} to {max(values):.1f})"
            cells += f"{text:>{width}}"
        label = {"bare": "bare AF_PACKET", "swarmtalkd": "app, daemon, daemon, app"}[name]
        print(f"{label:24}{cells}{sum(result['lost'] for result in results):>6}")
    ratios = [medians["swarmtalkd", key] / medians["bare", key]
              for key in ("p50_us", "p99_us", "cpu_us")]
    print(f"{'ratio':24}{ratios[0]:>22.2f}{ratios[1]:>24.2f}{ratios[2]:>22.2f}")


if __name__ == "__main__":
    main()
