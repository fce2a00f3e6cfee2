#!/usr/bin/python3
"""The same scenarios in sim-kilobot and argos-kilobot, side by side, and what makes the difference.

usage: benchmarks/argos_calibration.py [--build build-test] [--runs 10] [--seed 8001]
           [--programs hop_count hop_count_two_seeds firefly]

36 Kilobots on 50 mm, range 75 mm. Between the two stand simulators that are told, one after the
other, what ARGoS does differently: how often robots send (from its own figures), that packets take
no air and never collide, that all robots start at once. And on ARGoS's side: that all start at
once, and that nobody waits for the air (`ignore_conflicts` of the plugin's medium). Prints a table
in Markdown: mean and 95 % interval. Virtual time: the same seeds give the same table on any
machine. Needs ARGoS with its Kilobot plugin, and targets swarmtalk-sim and PROGRAM_kilobot.
"""
import argparse
import os
import pathlib
import statistics
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "suite/runner"))
import argos  # noqa: E402
import metrics  # noqa: E402
import platforms  # noqa: E402
import run_log  # noqa: E402
import scenarios  # noqa: E402

PROGRAMS = ("hop_count", "hop_count_two_seeds", "firefly")
ROWS = {"packets_per_s": "packets of a robot / s", "delivery": "delivery ratio",
        "latency_p50_s": "latency, median / s", "latency_p99_s": "latency, 99 % / s",
        "converged_s": "right after / s", "synchronised_s": "synchronised after / s",
        "spread_s": "spread of flashes / s"}
AT_ONCE = {"power_on_spread_us": 0}
NO_AIR = {"air_us": 1, "turnaround_us": 0, "backoff_us": 1}


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--seed", type=int, default=8001, help="of the first run")
    parser.add_argument("--programs", nargs="+", default=PROGRAMS, choices=PROGRAMS)
    return parser.parse_args()


def packets_per_s(log: run_log.Log) -> float:
    """That a robot sends, on average."""
    sent = log.air.get("sent")
    if sent is None:
        sent = sum(e["packets_sent"] for e in log.of("end"))
    return sent / log.robots / log.end_s()


def template_without_waits(robot: str) -> str:
    """ARGoS's experiment, but all who want to send at once do."""
    text = as_usual(robot)
    medium = '<kilobot_communication id="air"'
    assert medium in text
    return text.replace(medium, medium + ' ignore_conflicts="true"')


as_usual = argos.read_template


def run(folder: pathlib.Path, options, program: str, platform: str, radio: dict,
        clock: dict) -> dict[str, list[float]]:
    """Figures of all runs of one column, by key."""
    found = {key: [] for key in ROWS}
    for seed in range(options.seed, options.seed + options.runs):
        scenario = scenarios.resolve({"program": program, "platform": platform, "seed": seed,
                                      "robots": 36, "radio": dict(radio), "clock": dict(clock)})
        path = folder / "run.jsonl"
        if not platforms.run(scenario, path):
            raise platforms.Interrupted
        log = run_log.Log(str(path))
        result = metrics.evaluate(log) | {"packets_per_s": packets_per_s(log)}
        for key, values in found.items():
            if isinstance(result.get(key), (int, float)):
                values.append(result[key])
    return found


def cell(values: list[float], runs: int) -> str:
    if not values:
        return "never"
    mean, half = metrics.interval(values)
    few = f", {len(values)} of {runs} runs" if len(values) < runs else ""
    return f"{mean:.4g} +- {half:.2g}{few}" if half else f"{mean:.4g}{few}"


def period_s(program: str, found: dict[str, list[float]]) -> float:
    """Between two packets of a robot that has something to send, on average."""
    if program == "firefly":  # a message has four packets, and its first waits for half a period
        return statistics.mean(found["latency_p50_s"]) / 3.5
    return 1 / statistics.mean(found["packets_per_s"])  # hop counts are always sent


def compare(folder: pathlib.Path, options, program: str):
    """One program's table."""
    in_argos = run(folder, options, program, "argos-kilobot", {}, {})
    pace = {"period_us": round(1e6 * period_s(program, in_argos))}
    columns = {
        "`sim-kilobot`": run(folder, options, program, "sim-kilobot", {}, {}),
        "sends as often": run(folder, options, program, "sim-kilobot", pace, {}),
        "and no air time": run(folder, options, program, "sim-kilobot", pace | NO_AIR, {}),
        "and starts at once": run(folder, options, program, "sim-kilobot", pace | NO_AIR, AT_ONCE),
        "`argos-kilobot`, starts at once": run(folder, options, program, "argos-kilobot", {},
                                               AT_ONCE),
        "`argos-kilobot`": in_argos}
    argos.read_template = template_without_waits
    columns["`argos-kilobot`, nobody waits"] = run(folder, options, program, "argos-kilobot", {},
                                                   {})
    argos.read_template = as_usual
    print(f"| {program} | " + " | ".join(columns) + " |")
    print("|" + "---|" * (len(columns) + 1))
    for key, label in ROWS.items():
        if any(found[key] for found in columns.values()):
            print(f"| {label} | " + " | ".join(cell(found[key], options.runs)
                                               for found in columns.values()) + " |")
    print(flush=True)


def main() -> int:
    options = parse()
    os.environ["SWARMTALK_BUILD"] = str(options.build.resolve())
    platforms.catch_interrupts()
    try:
        with tempfile.TemporaryDirectory() as folder:
            for program in options.programs:
                compare(pathlib.Path(folder), options, program)
    except platforms.PlatformError as error:
        print(f"argos_calibration.py: {error}", file=sys.stderr)
        return 1
    except platforms.Interrupted:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
