"""What a Coachbot script gets of its robot (docs/coachbot.md), with a daemon that is a script and
a robot whose answers are written down."""
import logging

import pytest

import swarmtalk
from local_frames import field
from scripted_daemon import (ADVERTISE, ADVERTISED, DONE, FAILURE, GET_POSE, POSE, PUBLISH, SENT,
                             SET_POSE, SUBSCRIBE)

pytestmark = pytest.mark.logic


@pytest.fixture(name="world")
def meet_world(world):
    world.daemon.answers[ADVERTISE] = lambda number: field(
        ADVERTISED, field(1, number) + field(2, 5) + field(3, 100) + field(4, 7))
    world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
    world.meet()
    return world


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
    assert robot.get_pose() is None and world.daemon.poses() == []
    coachbot.pose = (1.0, 2.0, 0.5, "more")
    assert robot.get_pose() == (1.0, 2.0, 0.5, "more")
    assert robot.get_pose() == (1.0, 2.0, 0.5, "more"), "the last that is known"
    world.settle()
    assert world.daemon.poses() == [1]
    for x, seconds in ((2.0, 0.019), (3.0, 0.002)):
        coachbot.pose = (x, 2.0, 0.5)
        world.now += seconds
        robot.recv()  # any call tells a new one, at most each 20 ms
        world.settle()
    assert world.daemon.poses() == [1, 3]


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


def published(world):
    return [each[3].decode() for each in world.daemon.of(PUBLISH)]


@pytest.fixture(name="at_death")
def make_at_death(monkeypatch):
    """What the program prints of what kills it, and what is called then."""
    printed = []
    monkeypatch.setattr(swarmtalk.sys, "excepthook", lambda kind, *_: printed.append(kind))

    def die(error):
        try:
            raise error
        except BaseException:
            swarmtalk.sys.excepthook(*swarmtalk.sys.exc_info())
    die.printed = printed
    return die


def test_what_ends_a_program_with_wrap_goes_to_the_debug_channel(world, monkeypatch, at_death):
    monkeypatch.setenv("SWARMTALK_SOCKET", str(world.daemon.path))
    world.daemon.drop()
    coachbot = Coachbot()
    robot = swarmtalk.wrap(coachbot, "team", 0.5, "walk")
    try:
        (team, debug) = world.daemon.of(ADVERTISE)[-2:]
        assert team[1] == field(1, "team") and debug == {1: field(1, "debug"), 2: 4, 4: 16, 5: 1}
        assert world.daemon.of(SUBSCRIBE)[-1][3] == swarmtalk.struct.pack("<f", 0.5)
        at_death(KeyboardInterrupt())
        assert published(world) == [] and at_death.printed == [KeyboardInterrupt]
        begin = world.now
        at_death(KeyError("battery"))
        assert at_death.printed == [KeyboardInterrupt, KeyError]
        lines = published(world)
        assert lines[0] == "walk died on robot 77:" and lines[-1] == "KeyError: 'battery'"
        assert 1 <= world.now - begin < 1.2, "a second at most, until it has left"
    finally:
        robot.swarm.close()
    at_death(KeyError("again"))
    assert at_death.printed[2:] == [KeyError] and published(world) == lines


def test_a_traceback_that_has_left_is_waited_for_no_longer(world, monkeypatch, at_death):
    monkeypatch.setenv("SWARMTALK_SOCKET", str(world.daemon.path))
    world.daemon.drop()
    swarm = swarmtalk.wrap(None).swarm
    id_ = world.daemon.newest_id(ADVERTISE)
    serve, begin = world.daemon.serve, world.now

    def leave():
        before = len(world.daemon.of(PUBLISH))
        did = serve()
        for number in range(before, len(world.daemon.of(PUBLISH))):
            world.daemon.tell(field(SENT, field(1, id_) + field(2, number + 1)))
        return did
    world.daemon.serve = leave
    at_death(KeyError("battery"))
    assert world.now - begin < 0.1 and published(world)[-1] == "KeyError: 'battery'"
    swarm.close()


def test_of_a_long_traceback_the_last_lines_are_sent(world, monkeypatch, at_death):
    monkeypatch.setenv("SWARMTALK_SOCKET", str(world.daemon.path))
    world.daemon.drop()
    swarm = swarmtalk.wrap().swarm
    at_death(ValueError("\n".join("line %d" % number for number in range(40))))
    lines = published(world)
    assert lines == ["usr_code died on robot 77:"] + ["line %d" % each for each in range(25, 40)]
    swarm.close()


@pytest.mark.parametrize("code, words", [
    (5, "a traceback stays on this robot: no room"),
    (7, "no room")])
def test_a_debug_channel_that_is_off_is_told_at_the_start(
        world, monkeypatch, capsys, at_death, code, words):
    monkeypatch.setenv("SWARMTALK_SOCKET", str(world.daemon.path))
    world.daemon.drop()
    answer = world.daemon.answers[ADVERTISE]
    world.daemon.answers[ADVERTISE] = lambda number: answer(number) if len(
        world.daemon.of(ADVERTISE)) == 1 else field(FAILURE, field(1, code) + field(2, "no room"))
    swarm = swarmtalk.wrap().swarm
    (told,) = capsys.readouterr().err.splitlines()
    assert told.startswith("swarmtalk: " + words)
    at_death(KeyError("battery"))
    assert at_death.printed == [KeyError] and published(world) == []
    swarm.close()


def test_a_traceback_that_cannot_be_sent_is_told(world, monkeypatch, capsys, at_death):
    monkeypatch.setenv("SWARMTALK_SOCKET", str(world.daemon.path))
    world.daemon.drop()
    swarm = swarmtalk.wrap().swarm
    swarm._log.max_message_bytes = 10
    at_death(KeyError("battery"))
    (told,) = [line for line in capsys.readouterr().err.splitlines() if "could not" in line]
    assert told.startswith("swarmtalk: the traceback could not be sent to the other robots: the "
                           "message has ")
    swarm.close()


def test_a_script_that_sends_in_a_callback_of_its_own_does_not_run_in_it(world):
    robot = swarmtalk.Robot(None, world.client)
    world.client.subscribe("b", lambda message: world.heard.append(robot.send_msg("answer")))
    world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "x")
    world.now += 1
    world.client.run(0.1)
    assert world.heard == [True] and published(world) == ["answer"]


def test_a_script_that_only_sends_or_only_hears_is_told_nothing(world, capsys):
    robot = swarmtalk.Robot(None, world.client)
    world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "x")
    for _ in range(3):
        robot.send_msg("x")
        world.now += 0.2
    world.settle()
    world.client.on_error = None
    world.client.request_timeout = 0.1
    world.client.close()
    assert "never fetched" not in capsys.readouterr().err
    with pytest.raises(AttributeError):
        robot._mine


def run_main(*words):
    return swarmtalk.main([str(word) for word in words])


def test_the_command_runs_a_script_or_says_why_not(world, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("SWARMTALK_SOCKET", str(world.daemon.path))
    world.daemon.answers[GET_POSE] = lambda _: field(POSE, b"")

    def run(text, *words):
        path = tmp_path / "script.py"
        path.write_text(text)
        world.daemon.drop()
        code = run_main(*words, path)
        return code, capsys.readouterr().err.splitlines()
    assert run("def usr(robot):\n    robot.send_msg('hi')\n", "--channel", "team",
               "--within", "2.5") == (0, [])
    assert published(world) == ["hi"]
    assert world.daemon.of(ADVERTISE)[0][1] == field(1, "team")
    assert world.daemon.of(SUBSCRIBE)[0][3] == swarmtalk.struct.pack("<f", 2.5)
    assert run("def usr(robot):\n    raise SystemExit(7)\n") == (7, [])
    assert run("def usr(robot):\n    raise KeyboardInterrupt\n") == (130, [])
    code, told = run("def usr(robot):\n    open('/nowhere/file')\n")
    assert code == 1 and told[0].startswith("Traceback") and told[-1].startswith(
        "FileNotFoundError") and not any("swarmtalk.py" in line for line in told)
    code, told = run("def usr(robot):\n    return 1 / 0\n")
    assert code == 1 and "ZeroDivisionError" in told[-2] + told[-1]
    code, told = run("def usr(robot):\n    robot.swarm.subscribe(-1)\n")
    assert code == 1 and any("usr" in line for line in told)
    code, told = run("x = 1\n")
    assert code == 1 and told[-1].endswith("script.py has no function usr(robot)")
    assert run_main(tmp_path / "none.py") == 2
    assert "swarmtalk: cannot read " in capsys.readouterr().err
    world.daemon.stop()
    assert run_main(tmp_path / "script.py") == 3
    assert "does not exist" in capsys.readouterr().err


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_a_script_in_another_encoding_is_refused_with_the_remedy(
        world, tmp_path, monkeypatch, capsys, encoding):
    monkeypatch.setenv("SWARMTALK_SOCKET", str(world.daemon.path))
    path = tmp_path / "script.py"
    path.write_bytes("def usr(robot):\n    pass\n".encode(encoding))
    known = len(world.daemon.of(ADVERTISE))
    assert run_main(path) == 1
    assert capsys.readouterr().err == "swarmtalk: %s is %s; save it as UTF-8\n" % (
        path, encoding[:6].upper())
    assert len(world.daemon.of(ADVERTISE)) == known, "the daemon is asked for nothing"


def test_another_python_gets_the_same_words(monkeypatch, capsys):
    started = []
    monkeypatch.setattr(swarmtalk.os, "execvp", lambda *words: started.append(words))
    monkeypatch.setattr(swarmtalk, "run_script", lambda *_: None)
    run_main("--python", "python2.7", "--channel", "team", "--within", "0.45", "x.py")
    run_main("--python", "python2.7", "x.py")
    own = swarmtalk.os.path.abspath(swarmtalk.__file__)
    head = ["python2.7", own, "--channel"]
    assert started == [("python2.7", head + ["team", "--within", "0.45", "x.py"]),
                       ("python2.7", head + ["coachbot", "x.py"])]

    def fail(*_):
        raise FileNotFoundError(2, "No such file or directory")
    monkeypatch.setattr(swarmtalk.os, "execvp", fail)
    assert run_main("--python", "python1.5", "x.py") == 2
    assert capsys.readouterr().err == ("swarmtalk: python1.5 cannot be started: No such file or "
                                       "directory\n")
