"""The whole way: command line, daemon, bridge, emulated controller, infrared, emulated robots."""
import json
import time

import pytest
import swarm
from table import (EMULATOR, IMAGES, Daemon, Wire, kilobot_link, needs_emulator, needs_root,
                   wait_for)

pytestmark = needs_emulator

SPEED = 2.0        # emulated seconds per second, at most
TIME_SCALE = 1.3   # what the bridge believes: a margin for a busy machine
SETTLE_MS = 1800   # the controller flashes for 2 s
BEACON_TYPE = 0x10


def start_emulator(stack, robots, medium=None, **root):
    """Robots and a controller behind stack.folder/ohc, until the test ends."""
    scenario = stack.folder / "scenario.toml"
    log = stack.folder / "log.jsonl"
    ohc = {"image": swarm.image("overhead"), "infrared_pin": "D3", "pty": str(stack.folder / "ohc")}
    scenario.write_text(swarm.scenario_text(
        robots, {"seconds": 0, "seed": 1, "real_time_factor": SPEED, **root}, medium or {}, ohc))
    stack.start("emulator", EMULATOR, "--scenario", scenario, "--log", log)
    wait_for((stack.folder / "ohc").exists, what="the controller's terminal")
    return log


def air(node: int, x_m: float) -> str:
    return (f'[node]\nid = {node}\npose = [{x_m}, 0.0, 0.0]\n'
            '[links.air]\ntype = "raw_l2"\ninterface = "air0"\n')


def say_until(daemon, channel, number, is_answered):
    """Tells the robots a number until one answers: nothing acknowledges, and a robot that talks at
    the moment hears none of a message's copies. @return the answers"""
    for _ in range(5):
        done = daemon.cli("pub", channel, "--hex", number, "-W", 60)
        assert done.returncode == 0, done.stderr
        deadline = time.monotonic() + 5
        while time.monotonic() < deadline:
            if answers := is_answered():
                return answers
            time.sleep(0.05)
    raise AssertionError("no answer to five messages")


def status_tells_versions_and_the_battery(daemon):
    def state_with(*parts):
        return all(part in daemon.link("table")["state"] for part in parts)

    wait_for(lambda: state_with("ohc (version 2)"), what="the controller's version")
    wait_for(lambda: state_with("has uid 77, version 1, battery 700 (green)"), what="the battery")
    # Where robots are is heard as a message of no profile.
    assert daemon.kilobot("position", "7,120,-45,90").returncode == 0
    wait_for(lambda: daemon.link("table")["counters"]["gateway_other_messages"] == 1,
             what="the position")


@needs_root
def test_from_the_command_line_through_robots_to_another_daemon(stack):
    """A number from `pub` is counted up by the robots and heard far away, with its distance."""
    robots = [{"x_mm": 0, "y_mm": 0, "image": swarm.image("gateway"),
               "pty": str(stack.folder / "gateway"), "uid": 77}]
    robots += [{"x_mm": x, "y_mm": y, "image": swarm.image("hop_count"), "uid": uid}
               for x, y, uid in ((50, 0, 11), (0, 50, 12), (50, 50, 13))]
    start_emulator(stack, robots, {"range_mm": 100})
    wire = Wire(stack)
    table = kilobot_link(stack.folder / "ohc", stack.folder / "gateway", settle_ms=SETTLE_MS,
                         time_scale=TIME_SCALE, node_id=248)
    rules = ('[[gateway]]\nfrom = "table/0"\nto = "air/5"\n'
             '[[gateway]]\nfrom = "air/6"\nto = "table/0"\n')
    near = Daemon(stack, "near", air(3, 0.0) + table + rules, wire.prefix(0)).wait_up()
    far = Daemon(stack, "far", air(4, 5.0), wire.prefix(1)).wait_up()
    near.wait_link("table")
    status_tells_versions_and_the_battery(near)
    here = stack.start("here", *near.words("sub", 0, "--json"))
    there = stack.start("there", *far.words("sub", 5, "--json"))

    def run_is_heard():  # again, as an operator does, should the emulator lag behind
        done = near.kilobot("run")
        assert (done.returncode, done.stdout) == (0, "sent run\n"), done.stderr
        return there.lines()

    wait_for(run_is_heard, what="the robots' first message")

    def heard(sub, first_byte):
        """Messages that begin with this byte, whatever they are padded with."""
        return [line for line in sub.lines() if line["hex"].startswith(first_byte)]

    message = say_until(near, 0, "07", lambda: heard(there, "08"))[0]
    assert message["hex"] == "0800000000", "robots pad to a whole packet"
    assert message["distance_m"] == pytest.approx(5.0, abs=0.01), "of the daemon that sent it"
    own = wait_for(lambda: [m for m in heard(here, "08") if m["distance_m"] is not None],
                   what="the robots' distance")[0]
    assert own["distance_m"] in (pytest.approx(0.050, abs=0.003), pytest.approx(0.071, abs=0.003))
    # And back: from Wi-Fi to the robots.
    say_until(far, 6, "03", lambda: heard(there, "04"))
    counters = near.link("table")["counters"]
    print(json.dumps({key: value for key, value in counters.items() if value}))
    assert counters["gateway_frames_unreadable"] == 0
    assert counters["gateway_frames_missing"] == 0
    assert counters["own_echoes"] > 0, "the gateway hears the controller as well"
    assert counters["node_id_collisions"] == 0, "and takes it for nobody else"


@pytest.mark.field
def test_robots_with_a_program_of_2020_are_understood(stack):
    """Both ways, with packets of 2020: the number from `pub` comes back counted up."""
    robots = [{"x_mm": 0, "y_mm": 0, "image": swarm.image("gateway"),
               "pty": str(stack.folder / "gateway"), "uid": 77},
              {"x_mm": 50, "y_mm": 0, "image": swarm.image("hop_count_classic"), "uid": 11}]
    start_emulator(stack, robots, {"range_mm": 100})
    table = kilobot_link(stack.folder / "ohc", stack.folder / "gateway", settle_ms=SETTLE_MS,
                         time_scale=TIME_SCALE)
    daemon = Daemon(stack, "daemon", table.replace('profile = "kilobot"',
                                                   'profile = "classic2020"')).wait_up()
    daemon.wait_link("table")
    sub = stack.start("sub", *daemon.words("sub", 0, "--json"))

    def robot_says(first_byte):
        return [line for line in sub.lines()
                if line["hex"].startswith(first_byte) and line["distance_m"] is not None]

    def run_is_heard():
        assert daemon.kilobot("run").returncode == 0
        return robot_says("")

    wait_for(run_is_heard, what="the robot's first message")
    message = say_until(daemon, 0, "07", lambda: robot_says("08"))[0]
    assert message["distance_m"] == pytest.approx(0.050, abs=0.003)
    counters = daemon.link("table")["counters"]
    assert counters["own_echoes"] > 0
    # Programs of 2020 draw their ids at random: once in 255 runs it is ours, and we take another.
    # Echoes that we did not know would be a collision each.
    assert counters["node_id_collisions"] <= 1


@pytest.mark.field
def test_a_program_reaches_two_robots_and_runs(stack):
    robots = swarm.grid(1, 2, 40, image=swarm.image("hop_count"),
                        bootloader=swarm.image("bootloader"))
    log = start_emulator(stack, robots)
    daemon = Daemon(stack, "daemon", kilobot_link(stack.folder / "ohc", settle_ms=SETTLE_MS,
                                                  time_scale=TIME_SCALE)).wait_up()
    daemon.wait_link("table")
    done = daemon.kilobot("program", IMAGES / "beacon.hex", "--passes", 2)
    assert done.returncode == 0, done.stderr
    assert "sent 2 passes" in done.stdout
    assert "pass 2 of 2" in done.stderr

    def beacons():
        sent = swarm.Log(log.read_text().split("\n")[:-1]).of("sent", type=BEACON_TYPE)
        return {event["node"] for event in sent}

    assert beacons() == set(), "it waits for run"
    assert daemon.kilobot("run").stdout == "sent run\n"
    wait_for(lambda: beacons() == {"k0", "k1"}, timeout=150,
             what="both robots to run the new program")
