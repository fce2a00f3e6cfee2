"""Messages between robots: intact, sensed, and refused with a clear word when impossible."""
import json
import math
import time

import pytest
from conftest import needs_root, next_line, one_line, program, wait_for


def heard(process, timeout=90):
    out, errors = process.communicate(timeout=timeout)
    assert process.returncode == 0, errors
    return [json.loads(line) for line in out.splitlines()]


def a_message_crosses_with_distance_and_bearing(robots):
    """In a 2 x 2 grid, half a metre apart, all heading along +x."""
    listener = robots.start_sub(4, "greetings", "--json", "-C", "1", "-W", "60")
    assert robots.cli(1, "pub", "greetings", "good morning").returncode == 0
    message, = heard(listener)
    assert message["text"] == "good morning"
    assert message["sender"] == 1
    assert message["hops"] == 0
    assert message["distance_m"] == pytest.approx(math.hypot(0.5, 0.5), abs=0.002)
    # Robot 1 is behind and to the right of robot 4: at -135 degrees.
    assert message["bearing_rad"] == pytest.approx(-0.75 * math.pi, abs=0.01)


def every_robot_hears_it_once(robots):
    listeners = [robots.start_sub(i, "all", "--json") for i in (1, 2, 3)]
    assert robots.cli(2, "pub", "all", "x", "--ttl", "3").returncode == 0
    for listener in listeners:
        assert json.loads(next_line(listener))["text"] == "x"
    time.sleep(0.5)  # for whoever forwards it
    for listener in listeners:
        listener.terminate()
        assert listener.communicate(timeout=90)[0] == ""


def a_stale_pose_gives_an_unknown_distance_not_zero(robots):
    assert robots.cli(1, "pose", "set", "0", "0", "0", "--age-out").returncode == 0
    wait_for(lambda: robots.status(1)["pose"] is None, what="the pose to go stale")
    listener = robots.start_sub(2, "c", "--json", "-C", "1", "-W", "60")
    assert robots.cli(1, "pub", "c", "x").returncode == 0
    message, = heard(listener)
    assert message["distance_m"] is None
    assert message["bearing_rad"] is None


def every_size_crosses_two_namespaces_byte_for_byte(robots):
    receiver = robots.start(2, program("size_sweep"), "receive")
    done = robots.execute(1, program("size_sweep"), "send", timeout=240)
    receiver.terminate()
    receiver.communicate(timeout=90)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "16385 sizes, 0 to 16384 bytes, all intact" in done.stdout


def a_message_that_is_too_long_is_refused_with_the_limit(robots, tmp_path):
    words = tmp_path / "long"
    words.write_bytes(b"x" * 16385)
    done = robots.execute(1, "/bin/sh", "-c",
                          f"{program('swarmtalk-cli')} pub c - < {words}")
    one_line(done.stderr, "16385", "16384")
    assert done.returncode == 1


def an_empty_message_is_a_message(robots):
    listener = robots.start_sub(2, "c", "--json", "-C", "2", "-W", "60")
    assert robots.cli(1, "pub", "c", "").returncode == 0
    assert robots.cli(1, "pub", "c", "then").returncode == 0
    first, second = heard(listener)
    assert (first["text"], second["text"]) == ("", "then")


def a_listener_on_the_same_robot_hears_it_marked_local(robots):
    listener = robots.start_sub(1, "c", "--json", "-C", "1", "-W", "60")
    assert robots.cli(1, "pub", "c", "hi").returncode == 0
    message, = heard(listener)
    assert message["local"] is True
    assert message["distance_m"] == 0


def channels_are_apart(robots):
    listener = robots.start_sub(2, "left", "--json", "-C", "1", "-W", "60")
    assert robots.cli(1, "pub", "right", "x").returncode == 0
    assert robots.cli(1, "pub", "left", "y").returncode == 0
    out, _ = listener.communicate(timeout=90)
    assert [json.loads(line)["text"] for line in out.splitlines()] == ["y"]


@needs_root
def test_messages_between_robots_are_intact_sensed_or_refused(bridge_lab, udp_lab, tmp_path):
    every_size_crosses_two_namespaces_byte_for_byte(bridge_lab(2))
    raw, udp = bridge_lab(4), udp_lab(4)
    for robots in (raw, udp):
        for step in (a_message_crosses_with_distance_and_bearing, every_robot_hears_it_once,
                     an_empty_message_is_a_message, channels_are_apart,
                     a_listener_on_the_same_robot_hears_it_marked_local):
            step(robots)
        a_message_that_is_too_long_is_refused_with_the_limit(robots, tmp_path)
    a_stale_pose_gives_an_unknown_distance_not_zero(udp)
