#!/usr/bin/python3
"""What simulating the suite costs, by the number of robots.

usage: benchmarks/suite_speed.py [--build build-test] [--robots 100 1000 10000] [--runs 3]

Hop count with the Kilobot model: six neighbours, 524 ms period, 31 Hz loop, constant density, no
log. Instructions per robot-second by callgrind, starting up not counted: no other load on the
machine changes them. Times real time by the user CPU of whole runs, starting up included, median
and range: they are the machine's. Beside it what others publish: ARGoS 24 to 31 times real time
with 36 Kilobots, Kilombo 100 times with 1000 (on their machines).
"""
import argparse
import json
import os
import pathlib
import platform
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
SPACING_MM, ROW_MM, RANGE_MM = 50, 43.3, 60  # six neighbours, 50 mm away
TIMEOUT_S = 1000


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--robots", type=int, nargs="+", default=[100, 1000, 10000])
    parser.add_argument("--runs", type=int, default=3, help="of each, for the times")
    return parser.parse_args()


def scenario(folder, robots: int, seconds: float) -> pathlib.Path:
    """A file with `robots` in rows, each between two of the row before."""
    columns = round(robots ** 0.5)
    places = [{"x_mm": SPACING_MM * (i % columns) + SPACING_MM / 2 * (i // columns % 2),
               "y_mm": ROW_MM * (i // columns), "role": int(i == 0)} for i in range(robots)]
    path = pathlib.Path(folder) / "scenario.json"
    path.write_text(json.dumps({
        "program": "hop_count", "platform": "sim-kilobot", "seed": 1, "seconds": seconds,
        "robots": places, "radio": {"range_mm": RANGE_MM}}) + "\n")
    return path


def instructions(simulator, folder, robots: int, seconds: float) -> int:
    """Of a whole run."""
    done = subprocess.run(
        ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", simulator,
         scenario(folder, robots, seconds), "-"],
        capture_output=True, text=True, timeout=TIMEOUT_S, check=True)
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def per_robot_second(simulator, folder, robots: int, seconds: float) -> float:
    """Instructions of a simulated robot in a simulated second, without starting up."""
    first = instructions(simulator, folder, robots, seconds)
    return (instructions(simulator, folder, robots, 2 * seconds) - first) / (robots * seconds)


def times_real_time(simulator, folder, robots: int, seconds: float) -> float:
    """Simulated seconds per second of user CPU."""
    before = os.times().children_user
    subprocess.run([simulator, scenario(folder, robots, seconds), "-"], check=True,
                   timeout=TIMEOUT_S)
    return seconds / max(os.times().children_user - before, 1e-3)


def main() -> int:
    options = parse()
    simulator = options.build / "suite/swarmtalk-sim"
    if not simulator.exists():
        print(f"no {simulator}: build target swarmtalk-sim, or name the build with --build",
              file=sys.stderr)
        return 1
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"],
                            capture_output=True, text=True).stdout.strip()
    print(f"{platform.machine()}, Linux {platform.release()}, commit {commit}, "
          f"{options.runs} runs each")
    print(f"{'robots':>7} {'instr./robot-s':>15} {'growth':>7}   times real time")
    least = None
    with tempfile.TemporaryDirectory() as folder:
        for robots in options.robots:
            cost = per_robot_second(simulator, folder, robots, max(1, 2000 / robots))
            least = least or cost
            speeds = [times_real_time(simulator, folder, robots, max(12, 20000 / robots))
                      for _ in range(options.runs)]
            print(f"{robots:7} {cost:15,.0f} {cost / least:7.2f}   {statistics.median(speeds):.4g}"
                  f" ({min(speeds):.4g} to {max(speeds):.4g})", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
