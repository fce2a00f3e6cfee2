"""The Wi-Fi medium of sim/ beside ns-3: the same stations, places and moments on both models.
Neither knows of the other; what they are given is in broadcast.hpp."""
import json
import os
import pathlib
import subprocess

import pytest

pytestmark = pytest.mark.field
ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()
PAYLOAD_BYTES = 100

# Broadcasters, metres between them, us between two frames of each, s.
FEW = [(5, 5, 2000, 0.5), (20, 5, 20000, 0.5), (50, 20, 20000, 0.25)]
MORE = [(5, 5, 125000, 4), (20, 5, 4000, 1), (20, 20, 20000, 2), (50, 5, 20000, 1),
        (50, 5, 10000, 1), (50, 20, 40000, 2), (50, 20, 10000, 1)]


def delivered(name, case, seed=1):
    """Share of the frames that went on the air that arrived at a robot in range."""
    stations, spacing_m, period_us, seconds = case
    done = subprocess.run([BUILD / "tests/air" / name, *map(str, (
        stations, spacing_m, period_us, PAYLOAD_BYTES, seconds, seed))],
        capture_output=True, text=True, timeout=280, check=True)
    counts = json.loads(done.stdout)
    return counts["received"] / counts["expected"]


def compare(case):
    if not (BUILD / "tests/air/ns3_broadcast").exists():
        pytest.skip("no ns-3 here (tools/setup more, and configure again)")
    judge, ours = delivered("ns3_broadcast", case), delivered("our_broadcast", case)
    print(f"{case}: ns-3 {judge:.3f}, ours {ours:.3f}")
    assert abs(judge - ours) <= 0.10


@pytest.mark.parametrize("case", FEW, ids=lambda case: f"{case[0]}_at_{case[1]}_m")
def test_delivery_is_that_of_ns3(case):
    compare(case)


@pytest.mark.parametrize("case", MORE,
                         ids=lambda case: f"{case[0]}_at_{case[1]}_m_each_{case[2]}_us")
def test_delivery_is_that_of_ns3_from_idle_to_crowded_air(case):
    compare(case)
