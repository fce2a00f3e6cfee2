#!/usr/bin/python3
"""How right the buffering delay is that a program is given, between two daemons of one machine.

usage: benchmarks/buffering_delay.py [--build build-test] [--runs 5] [--count 2000]

Starts labs of two robots (root): on a link without a limit one message every millisecond; on a link
of 500 frames/s bursts of 5 every 10 ms, which wait for the pacer. Beside what the library says
stands the true time from send() to the callback; the difference is the wire and the error.
"""
import argparse
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
TIMEOUT_S = 120
CASES = {"no limit, 1 every 1 ms": ("", 1, 1000),
         "500 frames/s, 5 every 10 ms": ("[links.wifi]\nrate_hz = 500\n", 5, 10000)}


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--count", type=int, default=2000, help="messages in each run")
    return parser.parse_args()


def one_run(options, base, burst, gap_us):
    tool = [str(options.build / "lab/swarmtalk-lab"), "--name", f"delay{os.getpid()}"]
    app = options.build / "tests/integration/buffering_delay"
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as config:
        config.write(base)
        config.flush()
        subprocess.run([*tool, "up", "2", "--config", config.name], check=True, timeout=TIMEOUT_S,
                       stdout=subprocess.DEVNULL)
    try:
        def start(robot, *words):
            return subprocess.Popen([*tool, "exec", str(robot), "--", str(app), *map(str, words)],
                                    text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)

        receiver = start(2, "receive", options.count)
        line = receiver.stderr.readline()
        if "ready" not in line:
            sys.exit(f"buffering_delay.py: the receiver says: {line.strip()}")
        sender = start(1, "send", options.count, burst, gap_us)
        out, _ = receiver.communicate(timeout=TIMEOUT_S)
        sender.communicate(timeout=TIMEOUT_S)
        return json.loads(out)
    finally:
        subprocess.run([*tool, "down"], check=True, timeout=TIMEOUT_S)


def main():
    options = parse()
    if os.geteuid() != 0:
        sys.exit("buffering_delay.py: network namespaces need root")
    done = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], text=True,
                          capture_output=True)
    print(f"{options.count} messages a run, median (lowest to highest) of {options.runs} runs")
    print(f"commit {done.stdout.strip() or 'unknown'}, {os.cpu_count()} cores, "
          f"Linux {platform.release()}\n")
    print(f"{'':30}{'whole way p50 us':>26}{'error p50 us':>22}{'error p99 us':>26}")
    for name, (base, burst, gap_us) in CASES.items():
        results = [one_run(options, base, burst, gap_us) for _ in range(options.runs)]
        cells = ""
        for key, width in (("way_p50_us", 26), ("error_p50_us", 22), ("error_p99_us", 26)):
            values = [result[key] for result in results]
            text = f"{statistics.median(values):.1f} ({min(values):.1f} to {max(values):.1f})"
            cells += f"{text:>{width}}"
        print(f"{name:30}{cells}")


if __name__ == "__main__":
    main()
