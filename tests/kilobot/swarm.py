"""Runs Kilobot images in the emulator and reads its log.

SWARMTALK_BUILD names the build folder, with kilobot/ (images) and the emulator in it. Times are
emulated seconds; a run is the same for the same seed.
"""
import json
import os
import pathlib
import subprocess

import pytest

BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", "build-test")).resolve()
IMAGES = BUILD / "kilobot"
EMULATOR = pathlib.Path(os.environ.get(
    "KILOBOT_EMULATOR", BUILD / "emulation/kilobot/kilobot-emulator"))
RUN_SECONDS = 250  # wall clock; far more than any run needs, less than a test has

COLLECTING = "SWARMTALK_COLLECTING" in os.environ  # the build system asks for names only

if not COLLECTING and not (IMAGES / "hop_count.elf").exists():
    pytest.skip(f"no images in {IMAGES}: avr-g++ is missing (gcc-avr, avr-libc)",
                allow_module_level=True)
if not COLLECTING and not EMULATOR.exists():
    pytest.skip(f"no {EMULATOR}: libsimavr-dev is missing", allow_module_level=True)


def in_the_field(*values):
    """Values of a parametrised test that are of kind `field`."""
    return pytest.param(*values, marks=pytest.mark.field)


def image(name: str) -> str:
    """Path of one of our images, without its ending."""
    return str(IMAGES / f"{name}.elf")


def toml_value(value) -> str:
    """`value` as TOML: numbers, texts, flags, lists of texts."""
    return json.dumps(value)


def scenario_text(robots: list[dict], root: dict, medium: dict, ohc: dict | None) -> str:
    """A scenario file. `robots` are one table each, with the keys of the emulator's [[robot]]."""
    lines = [f"{key} = {toml_value(value)}" for key, value in root.items()]
    tables = [("[[robot]]", robot) for robot in robots] + [("[medium]", medium)]
    if ohc is not None:
        tables.append(("[ohc]", ohc))
    for header, table in tables:
        lines.append(header)
        lines += [f"{key} = {toml_value(value)}" for key, value in table.items()]
    return "\n".join(lines) + "\n"


def overhead(*commands: str) -> dict:
    """An overhead controller with our firmware; `commands` as in "run@2.5"."""
    return {"image": image("overhead"), "infrared_pin": "D3", "send": list(commands)}


class Log:
    """Events of a run. Each is a dict with time_us, node, event and what belongs to the event."""

    def __init__(self, lines):
        self.events = [json.loads(line) for line in lines if line.strip()]

    def of(self, event: str, node: str | None = None, **fields) -> list[dict]:
        """Events of one kind, of one node if given, with these values of their fields."""
        return [e for e in self.events if e["event"] == event
                and (node is None or e["node"] == node)
                and all(e.get(key) == value for key, value in fields.items())]

    def variable(self, node: str, name: str, at_s: float = float("inf")) -> int | None:
        """Last value of a watched variable up to a time."""
        found = [e for e in self.of("variable", node, name=name) if e["time_us"] <= at_s * 1e6]
        return found[-1]["value"] if found else None

    def sent(self, node: str, start_s: float = 0, end_s: float = float("inf")) -> int:
        """Messages that a node has sent between two times."""
        return sum(start_s * 1e6 < e["time_us"] <= end_s * 1e6 for e in self.of("sent", node))

    def end(self, node: str) -> dict:
        """A node's figures at the end of the run."""
        return self.of("end", node)[-1]

    def serial(self, node: str, start_s: float = 0) -> bytes:
        """What a node has written to its serial line from a time on."""
        return b"".join(bytes.fromhex(e["hex"]) for e in self.of("serial", node)
                        if e["time_us"] >= start_s * 1e6)


def emulate(tmp_path, robots: list[dict], *, medium: dict | None = None, ohc: dict | None = None,
            arguments: tuple = (), **root) -> Log:
    """Runs a scenario to its end. `root` has the scenario's own keys: seconds, seed, ..."""
    scenario = tmp_path / "scenario.toml"
    log = tmp_path / "log.jsonl"
    scenario.write_text(scenario_text(robots, root, medium or {}, ohc))
    result = subprocess.run(
        [EMULATOR, "--scenario", scenario, "--log", log, *map(str, arguments)],
        capture_output=True, text=True, timeout=RUN_SECONDS)
    assert result.returncode == 0, result.stderr
    print(result.stderr.strip())
    return Log(log.read_text().splitlines())


def grid(rows: int, columns: int, spacing_mm: float, **each) -> list[dict]:
    """Robots k0, k1, ... row by row."""
    return [{"x_mm": column * spacing_mm, "y_mm": row * spacing_mm, **each}
            for row in range(rows) for column in range(columns)]
