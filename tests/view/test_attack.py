"""The port of swarmtalk-view under attack (tests/hostile/attacks/view_storm.py): who looks goes on
looking, and nothing stays when the attackers have gone. test_server.py has one attack at a time."""
import json
import os
import subprocess
import sys
import time

import pytest
from conftest import ROOT, next_line, wait_for
from viewers import message_where, page

ATTACK = ROOT / "tests/hostile/attacks/view_storm.py"
SEED = os.environ.get("SWARMTALK_SEED", "1")
SECONDS, MESSAGES, LEAST_HEARD = 4, 80, 0.98


@pytest.fixture
def begin():
    running = []

    def start(view, *words):
        running.append(subprocess.Popen(
            [sys.executable, "-B", str(ATTACK), str(view.port), *map(str, words)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
        return running[-1]

    yield start
    for process in running:
        process.kill()
        process.communicate()


def resident_kib(view):
    with open(f"/proc/{view.process.pid}/status", encoding="ascii") as file:
        return int(next(line for line in file if line.startswith("VmRSS")).split()[1])


@pytest.mark.field
def test_who_looks_goes_on_under_attack_and_nothing_stays(make_lab, make_view, begin):
    lab = make_lab(2)
    view = make_view(lab.socket(1))
    before, resident = view.descriptors(), resident_kib(view)
    with page(view) as viewer:
        viewer.send(json.dumps({"op": "watch", "channel": "chat"}))
        message_where(viewer, lambda m: m["t"] == "info" and
                      any(c["name"] == "chat" for c in m["channels"]))
        attacks = [begin(view, SECONDS, int(SEED) + number) for number in range(2)]
        talker = lab.start_cli(2, "pub", "chat", "honest", "--repeat", str(MESSAGES), "--rate",
                               str(MESSAGES / SECONDS))
        heard = 0
        while heard < LEAST_HEARD * MESSAGES:
            told = message_where(viewer, lambda m: m["t"] == "msg", 30.0, "an honest message")
            heard += told["hex"] == b"honest".hex()
        made = [json.loads(next_line(attack)) for attack in attacks]
        with page(view) as other:
            message_where(other, lambda m: m["t"] == "state")
        grown = resident_kib(view) - resident
        talker.wait(timeout=60)
        for attack in attacks:
            attack.communicate("")
        gone = time.monotonic()
        wait_for(lambda: view.descriptors() <= before + 1, what="the attackers' descriptors")
        print(f"{heard} or more of {MESSAGES} heard, {made}, {grown} KiB more, descriptors back "
              f"after {time.monotonic() - gone:.1f} s")
    assert all(sum(each.values()) > 10 for each in made)
    assert any(each["refused"] for each in made)  # foreign pages and names, wrong tokens
    assert grown < 64 * 1024
    assert view.process.poll() is None
