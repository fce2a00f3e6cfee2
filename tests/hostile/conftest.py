"""Robots on a wire (tests/integration/wires.py) and a stranger on it that has no daemon."""
import importlib.util
import os
import pathlib
import sys

import pytest

HERE = pathlib.Path(__file__).resolve().parent
INTEGRATION = HERE.parent / "integration"
sys.path.append(str(INTEGRATION))
sys.path.append(str(HERE / "attacks"))

os.environ.setdefault("SWARMTALK_SEED", "1")
os.environ.setdefault("SWARMTALK_HOSTILE_SECONDS", "2")

# wires.py takes these from a module "conftest", and here that is this one.
_spec = importlib.util.spec_from_file_location("integration", INTEGRATION / "conftest.py")
_integration = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_integration)
BUILD, needs_root, program = _integration.BUILD, _integration.needs_root, _integration.program
run, wait_for = _integration.run, _integration.wait_for


def pytest_report_header():
    return f"SWARMTALK_SEED={os.environ['SWARMTALK_SEED']}"


@pytest.fixture
def air():
    """A wire, robots to come on it, and a stranger: air.attack(NAME, ...)."""
    from stranger import Air
    with Air() as made:
        yield made
