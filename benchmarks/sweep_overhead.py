#!/usr/bin/python3
"""What a sweep costs beside the runs in it, and how long it takes to go on with finished ones.

usage: benchmarks/sweep_overhead.py [--build build-test] [--runs 500] [--resumed 2000] [--pairs 3]

CPU time, of all processes, of the same hop counts (36 Kilobots, 12 s) by `swarmtalk-suite run` and
by `swarmtalk-suite sweep`, in pairs that take turns; then the time of a sweep whose runs are all
there but one, and of one whose runs are all there.
"""
import argparse
import json
import os
import pathlib
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
SUITE = ROOT / "suite/swarmtalk-suite"
TIMEOUT_S = 3000
FILE = "program = 'hop_count'\nrobots = {}\nseconds = 12\nruns = {}\nreport = ['converged_s']\n"


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--runs", type=int, default=500, help="of each side of a pair")
    parser.add_argument("--resumed", type=int, default=2000, help="finished runs")
    parser.add_argument("--pairs", type=int, default=3)
    return parser.parse_args()


def cost(folder, build, *words) -> tuple[float, float]:
    """CPU time and time of a command."""
    before, began = os.times(), time.monotonic()
    subprocess.run([SUITE, *map(str, words)], cwd=folder, check=True, timeout=TIMEOUT_S,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                   env=os.environ | {"SWARMTALK_BUILD": str(build.resolve())})
    after = os.times()
    return (after.children_user + after.children_system - before.children_user
            - before.children_system, time.monotonic() - began)


def make_finished(folder: pathlib.Path, build, runs: int):
    """A sweep in which all but the last run are finished: copies of the first, each with its own
    seed, since to read them again takes as long."""
    (folder / "s.toml").write_text(FILE.format(4, 1))
    cost(folder, build, "sweep", "s.toml")
    first = folder / "sweep-s/runs/00000/0.json"
    content = json.loads(first.read_text())
    for run in range(1, runs - 1):
        content["seed"] = content["result"]["seed"] = 1 + run
        first.with_name(f"{run}.json").write_text(json.dumps(content) + "\n")
    (folder / "s.toml").write_text(FILE.format(4, runs))


def main() -> int:
    options = parse()
    if not (options.build / "suite/swarmtalk-sim").exists():
        print(f"no {options.build}/suite/swarmtalk-sim: build it, or name the build with --build",
              file=sys.stderr)
        return 1
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"],
                            capture_output=True, text=True).stdout.strip()
    print(f"{platform.machine()}, Linux {platform.release()}, commit {commit}")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "s.toml").write_text(FILE.format(36, options.runs))
        ratios = []
        for pair in range(options.pairs):
            alone, _ = cost(folder, options.build, "run", "hop_count", "--runs", options.runs)
            shutil.rmtree(folder / "sweep-s", ignore_errors=True)
            swept, _ = cost(folder, options.build, "sweep", "s.toml")
            ratios.append(swept / alone)
            print(f"{options.runs} runs: {alone:.2f} s of CPU alone, {swept:.2f} s in a sweep: "
                  f"{100 * (swept / alone - 1):+.1f} %", flush=True)
        print(f"median {100 * (statistics.median(ratios) - 1):+.1f} %")
        shutil.rmtree(folder / "sweep-s")
        make_finished(folder, options.build, options.resumed)
        used, taken = cost(folder, options.build, "sweep", "s.toml")
        print(f"{options.resumed} runs, all there but one: {taken:.2f} s ({used:.2f} s of CPU), "
              "with that run, tables and report")
        used, taken = cost(folder, options.build, "sweep", "s.toml")
        print(f"{options.resumed} runs, all there: {taken:.2f} s ({used:.2f} s of CPU)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
