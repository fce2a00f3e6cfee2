"""What simulation costs, in instructions, which no other load on the machine changes."""
import json
import re
import shutil
import subprocess

import pytest

from test_runner import BUILD

ROBOT_SECOND_LIMIT = 30000
GROWTH_LIMIT = 1.5


def instructions(folder, robots: int, seconds: float) -> int:
    """Of hop count with the Kilobot model; six neighbours 50 mm away, no log."""
    columns = round(robots ** 0.5)
    places = [{"x_mm": 50 * (i % columns) + 25 * (i // columns % 2),
               "y_mm": 43.3 * (i // columns), "role": int(i == 0)} for i in range(robots)]
    scenario = folder / "scenario.json"
    scenario.write_text(json.dumps({
        "program": "hop_count", "platform": "sim-kilobot", "seed": 1, "seconds": seconds,
        "robots": places, "radio": {"range_mm": 60}}) + "\n")
    done = subprocess.run(
        ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null",
         BUILD / "suite/swarmtalk-sim", scenario, "-"],
        capture_output=True, text=True, timeout=250, check=True)
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def test_a_robot_second_costs_little_however_many_robots(tmp_path):
    if shutil.which("valgrind") is None:
        pytest.skip("no valgrind")
    cost = {}
    for robots, seconds in ((100, 20), (10000, 1)):
        first = instructions(tmp_path, robots, seconds)  # starting up is not counted
        cost[robots] = (instructions(tmp_path, robots, 2 * seconds) - first) / (robots * seconds)
        print(f"{robots} robots: {cost[robots]:.0f} instructions per robot-second")
    assert cost[100] <= ROBOT_SECOND_LIMIT
    assert cost[10000] <= GROWTH_LIMIT * cost[100]
