#!/usr/bin/python3
"""What a configuration or another daemon changes: labs side by side, run in turn, with a control.

usage: benchmarks/paired_labs.py [--build build-test] [--robots 2] [--pairs 9]
                                 [--config FILE] [--daemon PROGRAM] [--only SCENE]

Starts three labs of --robots robots (root): one as it is, one with --config and --daemon, one as it
is (the control). In each, one robot sends 64 B to all others, at 10, 100 and 1,000 messages/s and
64 at once every 2 ms ("saturation"); the labs are run in turn, --pairs times. Prints the medians of
CPU (of all programs and daemons, per message), p50 and p99 from send to callback, and the medians
of their ratios to the first lab, with the lowest and highest. A daemon's CPU is
/proc/PID/schedstat, so the kernel's work on its behalf counts as its own.
"""
import argparse
import json
import os
import pathlib
import platform
import signal
import statistics
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
TIMEOUT_S = 120
BYTES = 64
# Name: messages of a run, microseconds between, messages at once.
SCENES = {"10/s": (30, 100000, 1), "100/s": (200, 10000, 1), "1000/s": (2000, 1000, 1),
          "saturation": (12800, 2000, 64)}


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--robots", type=int, default=2)
    parser.add_argument("--pairs", type=int, default=9)
    parser.add_argument("--config", type=pathlib.Path, help="of the lab that is compared")
    parser.add_argument("--daemon", type=pathlib.Path, help="of the lab that is compared")
    parser.add_argument("--only", choices=SCENES)
    return parser.parse_args()


class Lab:
    def __init__(self, build, robots, name, *words):
        self.build, self.robots = build, robots
        self.tool = [str(build / "lab/swarmtalk-lab"), "--name", f"{name}{os.getpid()}"]
        subprocess.run([*self.tool, "up", str(robots), *map(str, words)], check=True,
                       timeout=TIMEOUT_S, stdout=subprocess.DEVNULL)
        done = subprocess.run([*self.tool, "status", "--json"], check=True, text=True,
                              timeout=TIMEOUT_S, capture_output=True)
        self.daemons = [json.loads(line)["pid"] for line in done.stdout.splitlines()]

    def start(self, robot, *words):
        program = [*self.tool, "exec", str(robot), "--", str(self.build / "benchmarks/latency")]
        return subprocess.Popen([*program, *map(str, words)], text=True, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE)

    def daemons_us(self):
        times_ns = (pathlib.Path(f"/proc/{pid}/schedstat").read_text().split()[0]
                    for pid in self.daemons)
        return sum(map(int, times_ns)) / 1000

    def run(self, count, gap_us, burst):
        """@return {"CPU", "p50", "p99": us}; of the receivers the median. Without any: CPU alone"""
        receivers = [self.start(robot, "receive", count) for robot in range(2, self.robots + 1)]
        for each in receivers:
            said = " "
            while "ready" not in said:
                said = each.stderr.readline()
                if not said:
                    sys.exit("paired_labs.py: a receiver ended before it was ready")
        time.sleep(0.2)
        before_us = self.daemons_us()
        sender = self.start(1, "send", count, BYTES, gap_us, burst)
        ends = [json.loads(each.communicate(timeout=TIMEOUT_S)[0]) for each in
                [sender, *receivers]]
        programs_us = sum(end["cpu_us"] for end in ends)
        figures = {"CPU": programs_us + (self.daemons_us() - before_us) / count}
        for name in ("p50", "p99") if receivers else ():
            figures[name] = statistics.median(end[f"{name}_us"] for end in ends[1:])
        return figures

    def down(self):
        subprocess.run([*self.tool, "down"], check=True, timeout=TIMEOUT_S)


def ratios(runs, first):
    each = [a / max(b, 1e-6) for a, b in zip(runs, first)]
    return f"{statistics.median(each):5.2f} ({min(each):.2f} to {max(each):.2f})"


def compare(labs, name, pairs):
    runs = {lab: [] for lab in labs}
    for i in range(pairs):
        turn = list(labs)[i % len(labs):] + list(labs)[:i % len(labs)]
        for lab in turn:
            runs[lab].append(labs[lab].run(*SCENES[name]))
    for figure in runs["first"][0]:
        values = {lab: [run[figure] for run in runs[lab]] for lab in labs}
        print(f"{name:10} {figure:4} {statistics.median(values['first']):8.1f} "
              f"{statistics.median(values['other']):8.1f} us   "
              f"other {ratios(values['other'], values['first']):22}   "
              f"control {ratios(values['control'], values['first'])}", flush=True)


def main():
    options = parse()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # the labs go, too
    bare = ("--config", ROOT / "tests/support/bare.toml")
    changed = ["--config", options.config or bare[1]]
    if options.daemon:
        changed += ["--daemon", options.daemon]
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], text=True,
                            capture_output=True, check=False).stdout.strip()
    print(f"{options.robots} robots, {options.pairs} rounds; commit {commit}, {os.cpu_count()} "
          f"cores, load {os.getloadavg()[0]:.2f}, Linux {platform.release()}")
    print("                   first    other      ratio to the first: median (lowest to highest)")
    labs = {}
    try:
        for name, words in (("first", bare), ("other", changed), ("control", bare)):
            labs[name] = Lab(options.build, options.robots, name, *words)
        for name in [options.only] if options.only else SCENES:
            compare(labs, name, options.pairs)
    finally:
        for lab in labs.values():
            lab.down()


if __name__ == "__main__":
    main()
