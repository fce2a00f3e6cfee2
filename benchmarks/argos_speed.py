#!/usr/bin/python3
"""How fast ARGoS simulates Kilobots with our controllers, beside the plugin's own.

usage: benchmarks/argos_speed.py --behavior FILE [--build build-test] [--robots 36] [--seconds 60]
           [--pairs 5]

The same experiment twice, in interleaved pairs: places, range, seed, steps a second. Once with our
module of hop count, all robots in the simulator's process; once with the plugin's own
kilobot_controller and FILE, a behaviour built with it, a process per robot (gradient_simple, of its
examples, is the nearest to hop count; it does less). CPU time of the simulator and of all that it
started, user and system, starting up included; wall time is the machine's and not told. Neither
writes a log.
"""
import argparse
import ctypes
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "suite/runner"))
import argos  # noqa: E402
import scenarios  # noqa: E402

PR_SET_CHILD_SUBREAPER = 36  # linux/prctl.h
TIMEOUT_S = 1000
THEIRS = """<kilobot_controller id="program">
      <actuators>
        <differential_steering implementation="default" />
        <kilobot_led implementation="default" />
        <kilobot_communication implementation="default" />
      </actuators>
      <sensors>
        <kilobot_communication implementation="default" medium="air" noise_std_dev="1" />
      </sensors>
      <params behavior="{behavior}" />
    </kilobot_controller>
  </controllers>"""


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--behavior", type=pathlib.Path, required=True)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--robots", type=int, default=36)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--pairs", type=int, default=5)
    return parser.parse_args()


def write_experiments(folder: pathlib.Path, options) -> tuple[pathlib.Path, pathlib.Path]:
    """Ours and theirs: the same but for what stands in <controllers>."""
    scenario = scenarios.resolve({"program": "hop_count", "platform": "argos-kilobot", "seed": 1,
                                  "robots": options.robots, "seconds": options.seconds})
    text = argos.experiment(argos.read_template("kilobot"), scenario, "kilobot",
                            options.build.resolve() / "argos", folder / "log", folder / "header")
    text = re.sub(r"<params log=[^>]*/>", "", text)
    ours = folder / "ours.argos"
    ours.write_text(text, encoding="utf-8")
    text = re.sub(r"<hop_count_kilobot.*</controllers>",
                  THEIRS.format(behavior=options.behavior.resolve()), text, flags=re.DOTALL)
    text = re.sub(r"<loop_functions.*</loop_functions>", "", text, flags=re.DOTALL)
    text = re.sub(r'(<controller config="program">)<params [^>]*/>', r"\1", text)
    theirs = folder / "theirs.argos"
    theirs.write_text(text, encoding="utf-8")
    return ours, theirs


def cpu_s(command: list, environment: dict) -> float:
    """Of a program and of all it starts, also of those that it leaves behind: they end as ours."""
    before = os.times()
    subprocess.run(command, check=True, timeout=TIMEOUT_S, env=environment,
                   stdout=subprocess.DEVNULL)
    while True:
        try:
            os.waitpid(-1, 0)
        except ChildProcessError:
            break
    after = os.times()
    return (after.children_user + after.children_system
            - before.children_user - before.children_system)


def main() -> int:
    options = parse()
    try:
        found = argos.read_installation(options.build)
    except argos.ArgosError as error:
        print(f"argos_speed.py: {error}", file=sys.stderr)
        return 1
    module = options.build / "argos/libhop_count_kilobot.so"
    for path, what in ((module, "build target hop_count_kilobot"),
                       (options.behavior, "build argos3-kilobot's examples")):
        if not path.exists():
            print(f"argos_speed.py: no {path}: {what}", file=sys.stderr)
            return 1
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)
    environment = os.environ | {"LD_LIBRARY_PATH": found["libraries"]}
    times = {"ours": [], "theirs": []}
    with tempfile.TemporaryDirectory() as folder:
        files = dict(zip(times, write_experiments(pathlib.Path(folder), options)))
        for pair in range(options.pairs):
            for name in sorted(times, reverse=pair % 2 == 1):
                times[name].append(cpu_s([found["program"], "-n", "-c", files[name]], environment))
    ratios = [theirs / ours for ours, theirs in zip(times["ours"], times["theirs"])]
    result = {"robots": options.robots, "seconds": options.seconds, "pairs": options.pairs}
    for name, values in times.items():
        result[name] = {"cpu_s": [round(each, 2) for each in values], "times_real_time": round(
            options.seconds / statistics.median(values), 1)}
    result["times_faster"] = {"median": round(statistics.median(ratios), 2),
                              "least": round(min(ratios), 2), "most": round(max(ratios), 2)}
    print(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
