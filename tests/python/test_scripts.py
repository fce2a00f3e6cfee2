"""What a Coachbot script gets of its robot (docs/coachbot.md), with a daemon that is a script and
a robot whose answers are written down."""
import logging

import pytest

import swarmtalk
from local_frames import field
from scripted_daemon import (ADVERTISE, ADVERTISED, DONE, FAILURE, GET_POSE, POSE, PUBLISH, SENT,
                             SET_POSE, SUBSCRIBE, World)
from test_connection import poses

pytestmark = pytest.mark.logic


@pytest.fixture(name="world")
def make_world(monkeypatch, tmp_path):
    world = World(monkeypatch, tmp_path / "s")
    world.daemon.answers[ADVERTISE] = lambda number: field(
        ADVERTISED, field(1, number) + field(2, 5) + field(3, 100) + field(4, 7))
    world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
    world.meet()
    yield world
    world.daemon.stop()
    world.client.close()


class Coachbot:
    """coach-os's robot: a pose is told once."""

    def __init__(self):
        self.pose, self.calls, self.virtual_id, self.id = None, [], 12, 3
        self.logger = logging.getLogger("coach-os")

    def get_pose(self):
        pose, self.pose = self.pose, None
        return pose

    def get_clock(self):
        return 42.5

    def delay(self, ms):
        self.calls.append(("delay", ms))

    def set_vel(self, left, right):
        self.calls.append(("set_vel", left, right))
        return "done"


def test_messages_go_out_and_come_in_as_they_are(world):
    robot = swarmtalk.Robot(None, world.client, "team", within=2.5)
    (asked,) = world.daemon.of(SUBSCRIBE)
    assert asked[1] == field(1, "team") and 3 in asked
    id_ = world.daemon.newest_id(SUBSCRIBE)
    assert robot.send_msg(b"\x00one") is True
    for data in (b"\x00\xff", b"two"):
        world.daemon.deliver(id_, data)
    assert robot.recv_msg() == [b"\x00\xff", b"two"] and robot.recv_msg() == []
    world.daemon.deliver(id_, "three")
    assert [message.text for message in robot.recv()] == ["three"]
    world.settle()
    assert [each[3] for each in world.daemon.of(PUBLISH)] == [b"\x00one"]
    with pytest.raises(swarmtalk.BadArgument):
        robot.send_msg(b"x" * 101)
    assert robot.swarm is world.client


def test_without_a_coachbot_time_and_pose_come_from_here_and_motors_do_nothing(world, capsys):
    robot = swarmtalk.Robot(None, world.client)
    begin = world.now
    robot.delay(250)
    assert 0.25 <= world.now - begin < 0.26
    robot.delay(-5)
    assert world.now - begin < 0.26 and abs(robot.get_clock() - (world.now - begin)) < 1e-6
    assert (robot.id, robot.virtual_id) == (77, 77) and robot.id() == robot.virtual_id() == 77
    for _ in range(2):
        assert robot.set_vel(10, 20) is True and robot.set_led(1, 2, 3) is True
    assert capsys.readouterr().err.splitlines() == [
        "swarmtalk: no Coachbot here: robot.set_vel() does nothing",
        "swarmtalk: no Coachbot here: robot.set_led() does nothing"]
    with pytest.raises(AttributeError, match="has no 'fly'; swarmtalk has more in robot.swarm"):
        robot.fly()
    world.daemon.answers[GET_POSE] = lambda _: field(FAILURE, field(1, 10) + field(2, "none"))
    with pytest.raises(swarmtalk.Error, match="none"):
        robot.get_pose()
    answers = iter([b"", b"", swarmtalk._float(1, 1) + swarmtalk._float(2, 2)
                    + swarmtalk._float(3, 0.5)])
    world.daemon.answers[GET_POSE] = lambda _: field(POSE, next(answers))
    assert robot.get_pose() is None
    begin = world.now
    assert robot.get_pose_blocking() == (1, 2, 0.5)
    assert 0.02 <= world.now - begin < 0.03


def test_a_coachbots_own_calls_and_numbers_come_first(world):
    coachbot = Coachbot()
    robot = swarmtalk.Robot(coachbot, world.client)
    assert robot.set_vel(10, 20) == "done" and robot.get_clock() == 42.5
    robot.delay(30)
    robot.delay()
    assert coachbot.calls == [("set_vel", 10, 20), ("delay", 30), ("delay", 20)]
    assert (robot.id, robot.virtual_id, robot.logger) == (3, 12, coachbot.logger)
    coachbot.id, coachbot.virtual_id = -1, lambda: 5
    assert (robot.id, robot.virtual_id) == (77, 5)
    with pytest.raises(AttributeError):
        robot.fly()


def test_a_coachbots_poses_are_told_to_the_daemon_each_once_and_not_too_often(world):
    coachbot = Coachbot()
    robot = swarmtalk.Robot(coachbot, world.client)
    assert robot.get_pose() is None and poses(world) == []
    coachbot.pose = (1.0, 2.0, 0.5, "more")
    assert robot.get_pose() == (1.0, 2.0, 0.5, "more")
    assert robot.get_pose() == (1.0, 2.0, 0.5, "more"), "the last that is known"
    world.settle()
    assert poses(world) == [1]
    for x, seconds in ((2.0, 0.019), (3.0, 0.002)):
        coachbot.pose = (x, 2.0, 0.5)
        world.now += seconds
        robot.recv()  # any call tells a new one, at most each 20 ms
        world.settle()
    assert poses(world) == [1, 3]


def test_a_pose_that_cannot_be_is_told_once_and_ends_no_script(world, capsys):
    coachbot = Coachbot()
    robot = swarmtalk.Robot(coachbot, world.client)
    for _ in range(2):
        coachbot.pose = (99.0, 0.0, 0.0)
        robot.get_pose()
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1 and told[0].startswith("swarmtalk: the pose (99.0, 0.0, 0.0) is not "
                                                 "passed on: a pose must be finite"), told
    world.daemon.stop()
    world.pass_time(0.1)
    coachbot.pose = (1.0, 0.0, 0.0)
    robot.get_pose()
    assert capsys.readouterr().err == ""


def test_messages_that_are_dropped_for_newer_ones_are_told_once_a_second(world, capsys):
    robot = swarmtalk.Robot(None, world.client)
    id_ = world.daemon.newest_id(ADVERTISE)

    def drop(number, code=14):
        world.daemon.tell(field(FAILURE, field(1, code) + field(2, "x") + field(4, id_)
                                + field(5, number)))
        world.settle()
    for _ in range(6):
        assert robot.send_msg("x")
    words = ("swarmtalk: send_msg(): %s dropped for newer ones, because the script sends faster "
             "than they leave; wait with robot.delay(50) between them")
    drop(1)
    assert capsys.readouterr().err.splitlines() == [words % "1 message was"]
    world.now += 0.9
    drop(2)
    drop(3)
    drop(4, 13)  # no link took it: not dropped
    world.daemon.tell(field(SENT, field(1, id_) + field(2, 5)))
    world.settle()
    assert capsys.readouterr().err == "" and robot.dropped == 3
    world.now += 0.1
    drop(6)
    assert capsys.readouterr().err.splitlines() == [words % "3 messages were"]
    assert robot.dropped == 4


def test_a_script_that_only_sends_is_told_what_comes(world):
    robot = swarmtalk.Robot(None, world.client)
    id_ = world.daemon.newest_id(ADVERTISE)
    robot.send_msg("x")
    world.daemon.serve()
    world.daemon.tell(field(FAILURE, field(1, 14) + field(2, "x") + field(4, id_) + field(5, 1)))
    world.now += 0.2
    robot.send_msg("y")
    assert robot.dropped == 1


def test_the_logger_of_a_script_writes_where_nothing_else_was_set_up(world, capsys):
    robot = swarmtalk.Robot(None, world.client)
    logger, root = logging.getLogger("usr"), logging.getLogger()
    handlers, logger.handlers[:], root.handlers[:] = root.handlers[:], [], []
    try:
        robot.logger.info("hello")
        robot.logger.debug("not this")
        assert capsys.readouterr().err == "INFO: hello\n"
        assert len(logger.handlers) == 1
    finally:
        logger.handlers[:], root.handlers[:] = [], handlers


def test_what_kills_a_script_goes_to_the_debug_channel_line_by_line(world, tmp_path, monkeypatch):
    path = tmp_path / "walk.py"
    path.write_text("def usr(robot):\n    robot.send_msg('hi')\n    raise KeyError('battery')\n")
    monkeypatch.setenv("SWARMTALK_SOCKET", str(world.daemon.path))
    world.daemon.drop()
    with pytest.raises(KeyError, match="battery"):
        swarmtalk.run_script(str(path), Coachbot())
    lines = [each[3].decode() for each in world.daemon.of(PUBLISH)]
    assert lines[:2] == ["hi", "walk.py died on robot 77:"]
    assert lines[2].startswith("Traceback") and lines[-1] == "KeyError: 'battery'"
    assert any('walk.py", line 3, in usr' in line for line in lines)
    assert not any("swarmtalk.py" in line for line in lines), "calls of ours are left out"
    (tmp_path / "empty.py").write_text("x = 1\n")
    world.daemon.drop()
    with pytest.raises(swarmtalk.BadArgument, match=r"has no function usr\(robot\)"):
        swarmtalk.run_script(str(tmp_path / "empty.py"), Coachbot())
    with pytest.raises(IOError):
        swarmtalk.run_script(str(tmp_path / "none.py"))
