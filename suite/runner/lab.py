"""Platforms coachbot-lab and coachbot-radio: programs on the client library, each beside an
unmodified swarmtalkd in a network namespace of swarmtalk-lab; in real time. In coachbot-lab a
virtual range makes neighbourhoods of a medium in which all hear all; in coachbot-radio the medium
itself has a range, air time and collisions (docs/radio.md).
"""
import functools
import json
import os
import pathlib
import re
import sys
import tempfile

import limits

MOST_ROBOTS = 247  # node ids of 9-byte packets
# Bits of CAP_NET_ADMIN, CAP_NET_RAW and CAP_SYS_ADMIN (capabilities(7)).
NEEDED = 1 << 12 | 1 << 13 | 1 << 21
CONFIG = """[log]
level = "warning"
[links.wifi]
profile = "kilobot"
rate_hz = {rate_hz}
jitter_us = {jitter_us}
"""
VIRTUAL_RANGE = """virtual_range_m = {range_m}
virtual_range_unknown = "drop"
"""
KEYS = {"coachbot-lab": ("range_mm", "period_us"),
        "coachbot-radio": ("range_mm", "period_us", "loss")}


class LabError(Exception):
    """One line for the user: what cannot be run, and what to do."""


def config(scenario: dict) -> str:
    """What all daemons are given: the paper's packets at the simulated Coachbot's pace."""
    platform = scenario["platform"]
    for section in ("radio", "clock", "body"):
        for key in scenario.get(section, {}):
            if section != "radio" or key not in KEYS[platform]:
                raise LabError(f"{platform}: [{section}] has no key '{key}'; there is: "
                               + " ".join("radio." + k for k in KEYS[platform]))
    if scenario["faults"]:
        raise LabError(f"{platform} knows no faults: leave [[fault]] out, or use sim-coachbot")
    if scenario.get("random_ids"):
        raise LabError(f"{platform} numbers its robots: leave random_ids out, or use sim-coachbot")
    limits.check_sections(scenario)
    radio = scenario["radio"]
    period_us = radio.get("period_us", 50000)
    text = CONFIG.format(rate_hz=1e6 / period_us, jitter_us=period_us // 10)
    if platform == "coachbot-lab":
        text += VIRTUAL_RANGE.format(range_m=radio["range_mm"] / 1000)
    return text


def check(scenario: dict):
    """Raises LabError or ScenarioError where the scenario asks for what the lab cannot do."""
    if len(scenario["robots"]) > MOST_ROBOTS:
        raise LabError(f"{scenario['platform']} has at most {MOST_ROBOTS} robots (node ids of the "
                       "packets)")
    config(scenario)


@functools.cache
def has_namespaces() -> bool:
    """Whether swarmtalk-lab may make network namespaces; said once where root may not."""
    if os.geteuid() != 0:
        return False
    status = pathlib.Path("/proc/self/status").read_text(encoding="utf-8")
    rights = int(re.search(r"^CapEff:\s*(\w+)", status, re.M)[1], 16)
    if rights & NEEDED == NEEDED:
        return True
    print("swarmtalk-suite: this root may not make network namespaces (a container?): robots of a "
          "lab talk over UDP", file=sys.stderr)
    return False


def medium(scenario: dict) -> list:
    """The options of swarmtalk-lab that choose the medium."""
    if scenario["platform"] == "coachbot-lab":
        return ["--medium", "bridge" if has_namespaces() else "udp"]
    radio = scenario["radio"]
    return ["--medium", "radio" if has_namespaces() else "radio-udp", "--range",
            radio["range_mm"] / 1000, "--loss", radio.get("loss", 0)]


def merge(scenario: dict, folder: pathlib.Path) -> list[dict]:
    """The robots' logs as one, in order of time, from the first robot's start on."""
    events = []
    for path in folder.glob("*.jsonl"):
        with open(path, encoding="utf-8") as file:
            events += [json.loads(line) for line in file if line.endswith("}\n")]
    starts = [e["t"] for e in events if e["event"] == "start"]
    if not starts:
        return []
    first = min(starts)
    for e in events:
        e["t"] -= first
    events.sort(key=lambda e: e["t"])
    ends = {e["robot"]: e for e in events if e["event"] == "end"}
    for e in events:
        if e["event"] == "body" and e["robot"] in ends:
            ends[e["robot"]]["contacts"] = e["contacts"]
    stood_still = max((e["stood_still_ms"] for e in events if e["event"] == "body"), default=0)
    whole = len(ends) == len(scenario["robots"])
    seconds = min(e["t"] for e in ends.values()) / 1e6 if whole else 0
    return events + [{"event": "air", "seconds": seconds, "stood_still_s": stood_still / 1000}]


def memory_folder():
    """Where robots write while they run: a disk that is busy would keep them waiting for seconds.
    None where this system has no such place."""
    folder = pathlib.Path("/dev/shm")
    return folder if os.access(folder, os.W_OK | os.X_OK) else None


def run(scenario: dict, log: pathlib.Path, tool: str, robot: str, bodies: str, call):
    """One run. @param call  runs a command to its end; raises if that fails"""
    check(scenario)
    robots = len(scenario["robots"])
    with tempfile.TemporaryDirectory(prefix="swarmtalk-suite-", dir=memory_folder()) as name:
        folder = pathlib.Path(name)
        places, base = folder / "scenario.json", folder / "base.toml"
        base.write_text(config(scenario), encoding="utf-8")
        places.write_text(json.dumps(scenario) + "\n", encoding="utf-8")
        each = [tool, "exec", "all", "--no-prefix", "--", robot, places, folder]
        call([tool, "--name", f"suite{os.getpid()}", "run", robots, *medium(scenario), "--config",
              base, "--", bodies, places, folder, tool, *each])
        events = merge(scenario, folder)
    with open(log, "w", encoding="utf-8") as output:
        for event in [scenario] + events if events else []:
            output.write(json.dumps(event, separators=(",", ":")) + "\n")
