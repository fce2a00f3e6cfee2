"""Everything at once: a robot with two links, gateways between them and captures under way,
strangers on both wires and two users' programs at its socket, all from one seed.
SWARMTALK_HOSTILE_SECONDS=3600 makes it an hour; with a build under sanitizers their findings end
it."""
import json
import os
import pathlib
import re
import subprocess
import sys
import time

import pytest
from conftest import needs_root, program, wait_for
from local_client import open_to_everybody
from wires import heard

ATTACKS = pathlib.Path(__file__).resolve().parent / "attacks"
SECONDS = float(os.environ["SWARMTALK_HOSTILE_SECONDS"])
SEED = int(os.environ["SWARMTALK_SEED"])
USERS = (65534, 65533)
GATEWAYS = "".join(
    f'[[gateway]]\nfrom = "{one}"\nto = "{two}"\nboth_ways = true\n'
    for one, two in (("w/alarm", "small/3"), ("w/5", "small/5")))
CONFIG = ('[node]\nid = 1\n[reserved]\nreport = true\n[socket]\nmode = "0666"\n'
          '[links.w]\ntype = "raw_l2"\ninterface = "a0"\n'
          '[links.small]\ntype = "raw_l2"\ninterface = "b0"\nprofile = "kilobot"\nnode_id = 250\n')
FINDINGS = re.compile(r"AddressSanitizer|LeakSanitizer|runtime error|terminate called|Assertion")
CHANNELS = [5, 9]


def resident_kib(process):
    text = pathlib.Path(f"/proc/{process.pid}/status").read_text(encoding="ascii")
    return int(re.search(r"VmRSS:\s+(\d+)", text)[1])


def begin_attack(air, robot, name, interface, *words):
    """On a wire, from a place of its own."""
    command = ["ip", "netns", "exec", robot.namespace, sys.executable, "-B",
               ATTACKS / f"{name}.py", "--interface", interface, "--seed", SEED,
               "--seconds", SECONDS, *words]
    return air.keep(subprocess.Popen([str(word) for word in command], text=True,
                                     stdout=subprocess.PIPE, stderr=subprocess.PIPE))


@pytest.mark.field
@needs_root
def test_a_robot_under_siege_goes_on(air):
    air.wire("b")
    target = air.robot("a", "b").start(CONFIG + GATEWAYS)
    folder = pathlib.Path(target.socket).parent
    folder.chmod(0o755)
    honest, small = air.daemon(2), air.robot("b").start(
        '[node]\nid = 3\n[links.w]\ntype = "raw_l2"\ninterface = "b0"\nprofile = "kilobot"\n')
    captures = [target.begin("capture", "-w", air.file(f"{each}.pcapng")) for each in range(2)]
    numbers = {entry["name"]: entry["number"] for entry in target.status()["channels"]}
    channels = [*CHANNELS, *(number for number in numbers.values() if number)]
    other = air.robot("b")
    rate = 500 if SECONDS < 60 else 200  # for an hour, beside all else that runs
    attacks = [begin_attack(air, air.stranger, "air_storm", "a0", "--rate", rate, "--channel",
                            *channels),
               begin_attack(air, other, "air_storm", "b0", "--rate", rate, "--small",
                            "--channel", "3")]
    storm = open_to_everybody(folder) / "socket_storm.py"
    attacks += [air.keep(subprocess.Popen(
        [sys.executable, "-B", storm, target.socket, str(SECONDS), str(SEED + uid)], text=True,
        user=uid, group=uid, extra_groups=[], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE)) for uid in USERS]

    answered, largest_kib = 0, 0
    while any(attack.poll() is None for attack in attacks):
        assert target.daemon.poll() is None, target.logged()[-4000:]
        assert target.cli("status").returncode == 0, "an operator is answered"
        answered += 1
        largest_kib = max(largest_kib, resident_kib(target.daemon))
        time.sleep(min(1.0, SECONDS / 8))
    printed = []
    for attack in attacks:
        out, error = attack.communicate(timeout=90)
        assert attack.returncode == 0, error
        printed.append(out.strip())
    for capture in captures:
        capture.terminate()
        capture.communicate(timeout=90)
    # What they took is there again, and all is as before.
    wait_for(lambda: target.status()["clients"] == 1, what="the places")
    for robot in (target, honest, small):
        assert robot.daemon.poll() is None, robot.logged()[-4000:]
        assert not FINDINGS.search(robot.logged()), robot.logged()[-4000:]
    for sender, hearer, channel in ((honest, target, "after it"), (target, honest, "after it"),
                                    (small, target, "7")):
        listener = hearer.subscribe(channel, "-C", "1", "-W", "60")
        text = "still"
        publisher = sender.begin("pub", channel, text, "--repeat", "5", "--rate", "5")
        assert heard(listener)[0]["text"].startswith(text)
        assert publisher.wait(timeout=60) == 0
    counts = [json.loads(line) for line in printed[2:]]
    assert int(printed[0]) > 100 and all(each["requests"] > 20 for each in counts), printed
    counters = {name: count for name, count in target.link("w")["counters"].items()
                if count and "airtime" not in name}
    print(f"{SECONDS:.0f} s: {printed[0]} and {printed[1]} frames of strangers, {counts}; "
          f"{answered} operators answered; {largest_kib} KiB at most; "
          f"{counters}")
    limit_kib = 256 * 1024 if "asan" not in program("swarmtalkd") else 2048 * 1024
    assert largest_kib < limit_kib
