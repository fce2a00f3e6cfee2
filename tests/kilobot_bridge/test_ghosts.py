"""Ghosts reach a table of Kilobots by the overhead controller: through a daemon that is a gateway
between the air that they are on and the controller's line."""
import json
import pathlib
import subprocess
import sys

import pytest
from table import BUILD, Daemon, Double, Wire, kilobot_link, needs_root, wait_for

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "support"))

import ghost_scenario  # noqa: E402

SIM = BUILD / "suite/swarmtalk-sim"
GHOSTS = 2
FIRST_ID = 100
FROM_CONTROLLER = 3  # type of an infrared message: SwarmTalk, and its distance means nothing


@pytest.mark.field
@needs_root
@pytest.mark.skipif(not SIM.exists(), reason="swarmtalk-sim is not built")
def test_what_ghost_kilobots_say_leaves_the_overhead_controller(stack):
    double = Double(stack, "--robots", 1)
    wire = Wire(stack)
    table = kilobot_link(double.terminal, settle_ms=100, node_id=248)
    air = ('[node]\nid = 3\npose = [0.0, 0.0, 0.0]\n[links.air]\ntype = "raw_l2"\n'
           'interface = "air0"\nprofile = "kilobot"\n')
    rule = '[[gateway]]\nfrom = "air/0"\nto = "table/0"\n'
    daemon = Daemon(stack, "daemon", air + table + rule, wire.prefix(0)).wait_up()
    daemon.wait_link("table")
    assert daemon.kilobot("run").returncode == 0
    scenario = ghost_scenario.write(stack.folder / "ghosts.json", [(0, 0), (50, 0)], seconds=8,
                                    platform="sim-kilobot")
    done = subprocess.run([*wire.prefix(1), str(SIM), "--join", "air0", str(scenario), "-"],
                          capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["ghosts"] == GHOSTS and report["frames_sent"] > GHOSTS * 5
    crossed = daemon.status()["counters"]["gateway_sent"]
    assert crossed > 5

    def from_table():
        """Whole SwarmTalk messages of channel 0 that left as infrared light, undamaged."""
        sent = [bytes.fromhex(event["hex"]) for event in double.events("infrared", damaged=False)]
        # 9 bytes of payload, type, checksum (docs/wire-format.md); node 248, the gateway's.
        return [each for each in sent if each[9] == FROM_CONTROLLER and each[0] == 248]

    # A hop count from ghost 0 (the seed): 0, and from ghost 1: 1 hop; as payload behind 3 bytes.
    counts = wait_for(lambda: {each[3] for each in from_table()} >= {0, 1} and from_table(),
                      what="both ghosts' counts on the table")
    assert len(counts) >= 3
