"""What simulation costs, in instructions, which no other load on the machine changes."""
import shutil
import sys

import pytest

from test_runner import BUILD, ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))
import suite_speed  # noqa: E402

ROBOT_SECOND_LIMIT = 30000
GROWTH_LIMIT = 1.5


def test_a_robot_second_costs_little_however_many_robots(tmp_path):
    if shutil.which("valgrind") is None:
        pytest.skip("no valgrind")
    cost = {}
    for robots, seconds in ((100, 20), (10000, 1)):
        cost[robots] = suite_speed.per_robot_second(BUILD / "suite/swarmtalk-sim", tmp_path, robots,
                                                    seconds)
        print(f"{robots} robots: {cost[robots]:.0f} instructions per robot-second")
    assert cost[100] <= ROBOT_SECOND_LIMIT
    assert cost[10000] <= GROWTH_LIMIT * cost[100]
