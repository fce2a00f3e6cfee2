"""swarmtalk-sim --join: simulated robots on the air of daemons, in a lab's radio, on a wire."""
import collections
import json
import math
import pathlib
import signal
import subprocess
import sys

import pytest
from conftest import BUILD, needs_root, one_line, program, run, wait_for
from wires import Wires, written

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

import ghost_scenario  # noqa: E402

SIM = BUILD / "suite/swarmtalk-sim"
FIRST_ID = 100
SPACING_M = 0.5
RANGE_M = 0.8  # the eight robots around one on the grid
PROFILE = 'profile = "kilobot"\n'

pytestmark = [needs_root,
              pytest.mark.skipif(not SIM.exists(), reason="swarmtalk-sim is not built")]


def join(target, scenario, log="-", prefix=(), **options):
    return subprocess.Popen([*prefix, str(SIM), "--join", str(target), *map(str, (scenario, log))],
                            text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, **options)


def report_of(process, timeout=60):
    out, errors = process.communicate(timeout=timeout)
    assert process.returncode == 0, errors
    return json.loads(out)


def grid(count):
    """Places in metres, ten a row: the lab's robots stand on the first ones of theirs."""
    return [(SPACING_M * (i % 10), SPACING_M * (i // 10)) for i in range(count)]


def listen(lab, robot, file):
    """`swarmtalk-cli sub` into a file: a pipe holds few messages."""
    before = lab.subscriptions(robot)
    process = lab.start(robot, "sh", "-c", f"exec {program('swarmtalk-cli')} sub 0 --json > {file}")
    wait_for(lambda: lab.subscriptions(robot) > before, what="subscription")
    return process


def neighbours(lab, robot):
    return json.loads(lab.cli(robot, "neighbours", "--json").stdout)["neighbours"]


def test_ghosts_share_the_air_of_a_lab_and_of_a_wire(radio_lab, wires, tmp_path):
    five_robots_and_95_ghosts_share_one_medium(radio_lab, tmp_path)
    on_a_wire_ghosts_can_be_filtered_and_their_deadlines_are_counted(wires, tmp_path)


def five_robots_and_95_ghosts_share_one_medium(radio_lab, tmp_path):
    """Who hears whom is decided by where they stand, for ghosts as for robots, both ways."""
    base = tmp_path / "base.toml"
    base.write_text(f"[links.wifi]\n{PROFILE}[log]\nlevel = \"warning\"\n")
    lab = radio_lab(5, "--range", RANGE_M, "--spacing", SPACING_M, "--config", base)
    real = [(robot["x_m"], robot["y_m"]) for robot in lab.medium()["robots"]]
    places = [place for place in grid(100 + len(real))
              if all(math.dist(place, other) > 0.01 for other in real)][:95]
    scenario = ghost_scenario.write(tmp_path / "ghosts.json",
                                    [(1000 * x, 1000 * y) for x, y in places], seconds=9)
    log = tmp_path / "ghosts.log"
    door = lab.execute(1, "sh", "-c", "echo $SWARMTALK_MEDIUM").stdout.strip()
    listeners = {robot: listen(lab, robot, tmp_path / f"{robot}.heard") for robot in (3, 5)}
    ghosts = join(door, scenario, log)
    try:
        wait_for(lambda: sum(robot["ghost"] for robot in lab.medium()["robots"]) == 95,
                 what="the ghosts")
        sent = 20
        done = lab.cli(5, "pub", "0", "x", "--repeat", sent, "--rate", "5")
        assert done.returncode == 0, done.stderr
        marks = {each["node_id"]: each["ghost"] for each in neighbours(lab, 5)}
        assert "ghost" in lab.cli(5, "neighbours").stdout
    finally:
        report = report_of(ghosts)
    near = {robot: {FIRST_ID + number for number, place in enumerate(places)
                    if math.dist(place, real[robot - 1]) <= RANGE_M} for robot in listeners}
    heard = {}
    for robot, process in listeners.items():
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        lines = (tmp_path / f"{robot}.heard").read_text().splitlines()
        heard[robot] = collections.Counter(json.loads(line)["sender"] for line in lines)
        ghosts_heard = {node for node in heard[robot] if node >= FIRST_ID}
        # From ghosts to robots: all who are in range, and nobody else.
        assert ghosts_heard == near[robot], (robot, ghosts_heard, near[robot])
        assert min(heard[robot][node] for node in near[robot]) >= 10, heard[robot]
    assert {node for node, is_ghost in marks.items() if is_ghost} == near[5]
    assert [is_ghost for node, is_ghost in marks.items() if node < FIRST_ID].count(True) == 0
    # From a robot to ghosts: most of its messages at each that is in range, none elsewhere.
    reached = collections.Counter(FIRST_ID + event["robot"]
                                  for event in ghost_scenario.received(log) if event["node"] == 5)
    assert set(reached) == near[5], reached
    assert sum(reached.values()) >= 0.7 * sent * len(near[5]), reached
    assert max(reached.values()) <= sent, reached
    # Among ghosts, through the same medium.
    assert report["packets_of_ghosts"] > 1000 and report["frames_unreadable"] == 0, report
    assert report["ghosts"] == 95 and report["late"]["events"] >= report["frames_sent"] > 5000
    status = lab.medium()
    assert status["ghosts"] == [] and len(status["robots"]) == 5, "they have left"
    lost = sum(count for cause, count in status["lost"].items()
               if cause not in ("queue_full", "interface"))
    assert status["received"] + lost == status["expected"]


def air(number, x_m, *keys):
    return "\n".join([f"[node]\nid = {number}\npose = [{x_m}, 0.0, 0.0]",
                      '[links.air]\ntype = "raw_l2"\ninterface = "a0"', PROFILE, *keys]) + "\n"


@pytest.fixture
def wires():
    with Wires() as made:
        made.wire("a")
        yield made


def on_a_wire_ghosts_can_be_filtered_and_their_deadlines_are_counted(wires, tmp_path):
    """Ranges come from poses."""
    hearing = wires.robot("a").start(air(1, 0.0))
    deaf = wires.robot("a").start(air(2, 0.1, 'ghosts = "ignore"'))
    short = wires.robot("a").start(air(3, 0.0, "virtual_range_m = 0.45"))
    host = wires.robot("a")
    subs = [robot.listen("sub", "--json", "0", file=True) for robot in (hearing, deaf, short)]
    # Ghosts at 0.3 m and 0.6 m; a robot 5 m away hears them, and they do not hear it.
    far = wires.robot("a").start(air(9, 5.0))
    scenario = ghost_scenario.write(tmp_path / "ghosts.json", [(300, 0), (600, 0)],
                                    seconds=11)  # missed deadlines are told every 10 s
    log = tmp_path / "ghosts.log"
    prefix = ("ip", "netns", "exec", host.namespace)
    ghosts = join("a0", scenario, log, prefix)
    wait_for(lambda: hearing.link("air")["counters"]["packets_received"] > 5, what="ghosts")
    for _ in range(5):
        hearing.publish("0", "x")
        far.publish("0", "x")
    marked = json.loads(deaf.cli("neighbours", "--json").stdout)["neighbours"]
    assert {each["node_id"]: each["ghost"] for each in marked if each["node_id"] >= FIRST_ID} == \
        {FIRST_ID: True, FIRST_ID + 1: True}
    ghosts.send_signal(signal.SIGSTOP)
    try:
        subprocess.run(["sleep", "0.6"], check=True)
    finally:
        ghosts.send_signal(signal.SIGCONT)
    out, errors = ghosts.communicate(timeout=60)
    assert ghosts.returncode == 0, errors
    report = json.loads(out)
    assert report["late"]["worst_us"] > 400000 and report["late"]["late"] >= 10, report
    assert "transmissions were more than 1000 us late, the worst by" in errors, errors
    senders = []
    for sub in subs:
        sub.send_signal(signal.SIGINT)
        sub.wait(timeout=60)
        senders.append({message["sender"] for message in written(sub)})
    assert senders[0] >= {FIRST_ID, FIRST_ID + 1}
    assert not {sender for sender in senders[1] if sender >= FIRST_ID}
    assert senders[2] & {FIRST_ID, FIRST_ID + 1} == {FIRST_ID}
    assert deaf.link("air")["counters"]["packets_of_ghosts"] >= report["frames_sent"] * 0.9
    assert hearing.link("air")["counters"]["packets_of_ghosts"] == 0
    nodes = collections.Counter(event["node"] for event in ghost_scenario.received(log))
    assert nodes[1] > 0 and nodes[9] == 0, nodes
    # A change takes effect with a reload.
    deaf.configure(air(2, 0.1))
    assert deaf.cli("reload").stdout == "applied: links.air.ghosts\n"


@pytest.mark.logic
def test_mistakes_get_one_line(tmp_path):
    scenario = ghost_scenario.write(tmp_path / "ghosts.json", [(0, 0)], seconds=1)
    many = ghost_scenario.write(tmp_path / "many.json", [(0, 0)] * 200, seconds=1)
    one_line(run(SIM, "--join", "nowhere0", scenario, "-").stderr, "no interface nowhere0")
    one_line(run(SIM, "--join", tmp_path / "no.sock", scenario, "-").stderr, "no radio of a lab")
    one_line(run(SIM, "--join", "lo", many, "-").stderr, "node ids 100 to 299")
    one_line(run(SIM, "--join", "lo", "--first-id", "0", scenario, "-").stderr, "usage")
    (tmp_path / "robot.toml").write_text(air(1, 0.0, 'ghosts = "no"'))
    done = run(program("swarmtalkd"), "--check", "--config", tmp_path / "robot.toml")
    assert done.returncode == 1
    one_line(done.stderr, "ghosts")
