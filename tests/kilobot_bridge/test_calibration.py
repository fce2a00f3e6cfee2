"""The live screen of `kilobot calibrate`, on a terminal, with the controller's double behind it."""
import os
import pty
import re
import shlex
import signal
import subprocess

import pytest
from table import Daemon, Double, kilobot_link, one_line, wait_for
from tmux import Tmux, needs_tmux

WAIT_S = 60


@pytest.fixture
def double(stack):
    return Double(stack, "--robots", 1)


@pytest.fixture
def daemon(stack, double):
    made = Daemon(stack, "daemon", kilobot_link(double.terminal, settle_ms=0,
                                                time_scale=0.6)).wait_up()
    made.wait_link("table")
    return made


def state(double):
    """Of the robot, as far as it has changed."""
    return [event["state"] for event in double.events("robot")][-1:]


def calibrations(double):
    """What was told the robot, as (mode, left turn, right turn, straight left, straight right)."""
    told = []
    for event in double.events("infrared", damaged=False):
        message = bytes.fromhex(event["hex"])
        if message[9] == 0x8A and told[-1:] != [(message[0], *message[3:7])]:
            told.append((message[0], *message[3:7]))
    return told


def screen_of(daemon, width=80):
    return Tmux(width, 24, shlex.join(daemon.words("kilobot", "calibrate")))


@needs_tmux
@pytest.mark.parametrize("width", [80, 40])
def test_each_change_is_sent_and_what_is_shown_is_saved(daemon, double, width):
    with screen_of(daemon, width) as screen:
        text = screen.wait("^> turn left +70  not sent$", WAIT_S)
        assert all(len(line) <= width for line in text.splitlines())
        for words in ("^MOTION +DUTY +ROBOT$", "^  straight right +65  not sent$", "q quit$"):
            assert re.search(words, text, re.M), text
        screen.keys("s")
        screen.wait("^nothing to save", WAIT_S)
        assert not calibrations(double)
        screen.keys("Right")
        screen.wait("^> turn left +71  sent$", WAIT_S)
        wait_for(lambda: state(double) == ["moving"], what="the robot to move")
        screen.keys("Down", "Down", "PPage")
        screen.wait("^> straight left +75  sent$", WAIT_S)
        screen.keys("s")
        text = screen.wait("^> straight left +75  sent and saved$", WAIT_S)
        assert re.search("^  turn left +71  sent and saved$", text, re.M), text
        assert re.search("^  turn right +70  not sent$", text, re.M), text
        wait_for(lambda: state(double) == ["idle"], what="the robot to save")
        screen.keys("u", "1", "3", "BSpace", "2", "Enter")
        screen.wait("^  uid +12  sent and saved$", WAIT_S)
        screen.keys("q")
        text = screen.wait("^exit code 0$", WAIT_S).replace("\n", "")
        assert "turn left 71, straight left 75, straight right 65; save was sent" in text, text
    told = calibrations(double)
    assert told[0] == (2, 71, 0, 0, 0)
    save = told.index((0, 0, 0, 0, 0))
    assert told[save - 2:save] == [(2, 71, 0, 0, 0), (4, 0, 0, 75, 65)], told
    last = double.end()
    assert last["robots"][0]["eeprom_uid"] == 12
    assert not last["repeating"]
    assert last["dangerous_frames"] == 0


@needs_tmux
def test_a_robot_that_moves_is_paused_at_the_end(daemon, double):
    with screen_of(daemon) as screen:
        screen.wait("not sent", WAIT_S)
        screen.keys("PPage", "PPage", "PPage", "PPage", "PPage", "PPage")
        screen.wait("^> turn left +120  sent$", WAIT_S)
        screen.keys("C-c")
        text = screen.wait("^exit code 130$", WAIT_S)
        assert "turn left 120; not saved: reset ends them; pause was sent" in text, text
    wait_for(lambda: state(double) == ["idle"], what="the robot to stand still")
    assert max(told[1] for told in calibrations(double)) == 120


@needs_tmux
def test_what_is_refused_is_shown_and_a_lost_daemon_ends_the_screen(stack, daemon, double):
    with screen_of(daemon) as screen:
        screen.wait("not sent", WAIT_S)
        held = stack.start("held", *daemon.words("kilobot", "run", "--hold", "0"))
        wait_for(lambda: state(double) == ["running"], what="the robot to run")
        screen.keys("Enter")
        screen.wait("^the overhead controller is busy with 'run', until it is stopped", WAIT_S)
        assert held.end(signal.SIGINT) == 130
        screen.keys("Enter")
        screen.wait("^> turn left +70  sent$", WAIT_S)
        daemon.process.end()
        text = screen.wait("^exit code 3$", WAIT_S)
        assert "a robot that moves goes on until pause" in text, text


def test_a_terminal_that_goes_away_leaves_no_robot_moving(daemon, double):
    ours, theirs = pty.openpty()
    process = subprocess.Popen(daemon.words("kilobot", "calibrate"), stdin=theirs, stdout=theirs,
                               stderr=subprocess.DEVNULL, start_new_session=True,
                               env={**os.environ, "TERM": "xterm"})
    os.close(theirs)
    assert os.read(ours, 10)
    os.write(ours, b"+")
    wait_for(lambda: state(double) == ["moving"], what="the robot to move")
    os.close(ours)
    process.communicate(timeout=WAIT_S)
    assert process.returncode != 0
    wait_for(lambda: state(double) == ["idle"], what="the robot to stand still")


def test_without_a_terminal_there_is_no_screen(daemon, double):
    before = double.frame_types()
    done = daemon.kilobot("calibrate")
    assert done.returncode == 1
    one_line(done.stderr, "draws on a terminal", "calibrate left, right and straight")
    assert double.frame_types() == before
