#!/usr/bin/python3
"""What a robot program in Python costs beside the same in C++.

usage: benchmarks/python_cost.py [--build build-test] [--pairs 9] [--python /usr/bin/python3]

Starts a lab of two robots (root) and runs, in turn, sender and receiver in C++ and in Python: 64 B
one by one every millisecond, and in bursts of 64 every 20 ms. CPU is that of the program, for each
message; the daemons cost the same either way. Prints medians over the pairs, and the median of the
pairs' ratios.
"""
import argparse
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys

import latency

ROOT = pathlib.Path(__file__).resolve().parents[1]
BYTES = 64
SCENES = {"one by one": (2000, 1000, 1), "bursts of 64": (12800, 20000, 64)}
FIGURES = {"send_us": "CPU us to send", "receive_us": "CPU us to receive", "p50_us": "p50 us",
           "p99_us": "p99 us"}


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--pairs", type=int, default=9)
    parser.add_argument("--python", default="/usr/bin/python3")
    return parser.parse_args()


def one_run(lab, app, count, gap_us, burst):
    receiver = lab.start(2, *app, "receive", count)
    line = receiver.stderr.readline()
    if "ready" not in line:
        sys.exit(f"python_cost.py: the receiver says: {line.strip()}")
    sender = lab.start(1, *app, "send", count, BYTES, gap_us, burst)
    sent, errors = sender.communicate(timeout=latency.TIMEOUT_S)
    if sender.returncode != 0:
        sys.exit(f"python_cost.py: the sender says: {errors.strip()}")
    got = json.loads(receiver.communicate(timeout=latency.TIMEOUT_S)[0])
    return {"send_us": json.loads(sent)["cpu_us"], "receive_us": got["cpu_us"],
            "p50_us": got["p50_us"], "p99_us": got["p99_us"], "lost": count - got["received"]}


def spread(values):
    return f"{statistics.median(values):.1f} ({min(values):.1f} to {max(values):.1f})"


def report(scene, runs, pairs):
    count, gap_us, burst = SCENES[scene]
    print(f"\n{scene}: {count} messages of {BYTES} B, {burst} every {gap_us / 1000:g} ms")
    print(f"{'':10}" + "".join(f"{title:>26}" for title in FIGURES.values()) + f"{'lost':>7}")
    for language, results in runs.items():
        cells = "".join(f"{spread([run[figure] for run in results]):>26}" for figure in FIGURES)
        print(f"{language:10}{cells}{sum(run['lost'] for run in results):>7}")
    cells = ""
    for figure in FIGURES:
        ratios = [runs["Python"][pair][figure] / runs["C++"][pair][figure]
                  for pair in range(pairs)]
        cells += f"{statistics.median(ratios):>26.2f}"
    print(f"{'ratio':10}{cells}")


def main():
    options = parse()
    if os.geteuid() != 0:
        sys.exit("python_cost.py: network namespaces need root")
    apps = {"C++": [options.build / "benchmarks/latency"],
            "Python": [options.python, ROOT / "benchmarks/latency_app.py"]}
    version = subprocess.run([options.python, "--version"], capture_output=True, text=True,
                             check=True).stdout.strip()
    print(f"median (lowest to highest) of {options.pairs} interleaved pairs\n"
          f"commit {latency.commit()}, {version}, {os.cpu_count()} cores, "
          f"Linux {platform.release()}, load average {os.getloadavg()[0]:.1f}")
    lab = latency.Lab(options.build)
    try:
        for scene, settings in SCENES.items():
            runs = {language: [] for language in apps}
            for pair in range(options.pairs):
                for language in sorted(apps, reverse=pair % 2 == 1):
                    runs[language].append(one_run(lab, apps[language], *settings))
            report(scene, runs, options.pairs)
    finally:
        lab.down()


if __name__ == "__main__":
    main()
