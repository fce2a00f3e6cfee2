"""What strangers on the air can do to robots that have a swarm key, and what they cannot."""
import time

import pytest
from conftest import needs_root, program, run, wait_for
from stranger import counter, tell
from wires import heard

pytestmark = needs_root
CHANNEL = "5"


@pytest.fixture
def keys(tmp_path):
    made = [tmp_path / "one.key", tmp_path / "two.key"]
    for key in made:
        done = run(program("swarmtalk-cli"), "keygen", key)
        assert done.returncode == 0, done.stderr
    return made


def believe_each_other(*robots):
    """Waits until each has taken frames of the others."""
    def known(robot):
        done = robot.cli("neighbours", "--json")
        return done.stdout.count('"node_id"') >= len(robots) - 1

    wait_for(lambda: all(known(robot) for robot in robots), what="robots that believe each other")


def test_recorded_frames_are_not_taken_whatever_starts_meanwhile(air, keys):
    line = f'key_file = "{keys[0]}"\n'
    attack = air.begin("replay", "--rate", 2000)
    sender, hearer = air.daemon(1, line), air.daemon(2, line)
    believe_each_other(sender, hearer)
    listener = hearer.subscribe(CHANNEL, "-C", "20", "-W", "20")
    sender.publish(CHANNEL, "open the gripper", "--repeat", "20", "--rate", "100")
    assert len(heard(listener)) == 20
    assert int(tell(attack, "stop")) >= 20
    listener = hearer.subscribe(CHANNEL, "-C", "1", "-W", "20")
    tell(attack, "play")
    sender.publish(CHANNEL, "now")
    assert [message["text"] for message in heard(listener)] == ["now"]
    # A change of battery: of the receiver, then of the sender.
    for robot in (hearer, sender):
        robot.stop()
        tell(attack, "order")
        number = 2 if robot is hearer else 1
        robot.start(f'[node]\nid = {number}\n[links.w]\ntype = "raw_l2"\ninterface = "a0"\n' + line)
        listener = hearer.subscribe(CHANNEL, "-C", "1", "-W", "20")
        tell(attack, "order")
        tell(attack, "play")
        believe_each_other(sender, hearer)
        sender.publish(CHANNEL, "now")
        assert [message["text"] for message in heard(listener)] == ["now"]
    assert counter(hearer, "frames_not_proven") + counter(hearer, "frames_replayed") > 20


def test_what_a_robot_says_first_is_heard(air, keys):
    line = f'key_file = "{keys[0]}"\n'
    hearer, sender = air.daemon(2, line), air.robot("a")
    starts = 5
    time.sleep(0.5)  # what comes in its first tenths of a second, a receiver cannot judge
    listener = hearer.subscribe(CHANNEL, "-C", starts, "-W", "40")
    for start in range(starts):
        sender.start(f'[node]\nid = 1\n[links.w]\ntype = "raw_l2"\ninterface = "a0"\n{line}',
                     wait=False)
        # Before it has shown that it lives.
        wait_for(lambda number=start: sender.cli("pub", CHANNEL, f"first {number}").returncode == 0,
                 what="the daemon")
        wait_for(lambda number=start: counter(hearer, "node_messages_received") > number,
                 what="its first message")
        sender.stop()
    assert [message["text"] for message in heard(listener)] == [
        f"first {start}" for start in range(starts)]
    assert counter(hearer, "frames_proven_later") > 0


def test_a_frame_of_an_older_release_is_counted_as_that(air, keys):
    line = f'key_file = "{keys[0]}"\n'
    old, new = air.daemon(1, line + "check_freshness = false\n"), air.daemon(2, line)
    assert "freshness not checked" in old.link("w")["state"]
    assert "freshness" not in new.link("w")["state"]
    old.publish(CHANNEL, "from long ago")
    wait_for(lambda: counter(new, "frames_not_fresh") > 0, what="the frame")
    assert counter(new, "frames_received") == 0
    listener = old.subscribe(CHANNEL, "-C", "1", "-W", "20")
    new.publish(CHANNEL, "from now")
    assert [message["text"] for message in heard(listener)] == ["from now"]


def test_keys_are_changed_by_reloads_and_no_message_is_lost(air, keys):
    one, two = keys
    head = '[node]\nid = {}\n[links.w]\ntype = "raw_l2"\ninterface = "a0"\n'
    steps = [f'key_file = "{one}"\n',
             f'key_file = "{one}"\nalso_key_file = "{two}"\n',
             f'key_file = "{two}"\nalso_key_file = "{one}"\n',
             f'key_file = "{two}"\n']
    robots = [air.daemon(1, steps[0]), air.daemon(2, steps[0])]
    sender, hearer = robots
    believe_each_other(*robots)
    messages = 1000
    listener = hearer.subscribe(CHANNEL, "-C", messages, "-W", "60", "--keep-last", "1000")
    publisher = sender.begin("pub", CHANNEL, "x", "--repeat", messages, "--rate", "500")
    for step in steps[1:]:
        for robot in robots:
            robot.configure(head.format(robot.number - 1) + step)
            done = robot.cli("reload")
            assert done.returncode == 0, done.stderr
    assert publisher.wait(timeout=60) == 0
    listened = heard(listener, timeout=60)
    assert len(listened) == messages
    assert sum(message["lost_before"]["air"] for message in listened) == 0
    assert counter(hearer, "frames_other_key") == 0
    assert counter(hearer, "frames_not_authentic") == 0
