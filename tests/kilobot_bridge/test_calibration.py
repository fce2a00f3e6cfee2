"""The live screen of `kilobot calibrate`, on a terminal, with the controller's double behind it."""
import os
import pty
import re
import shlex
import signal
import subprocess

from table import Daemon, Double, kilobot_link, wait_for
from tmux import Tmux, needs_tmux

WAIT_S = 60


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


def change_and_save(daemon, double):
    """Each change is sent, and what is shown is saved."""
    with screen_of(daemon) as screen:
        text = screen.wait("^> turn left +70  not sent$", WAIT_S)
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


def leave_a_moving_robot(daemon, double):
    """It is paused at the end; on a narrow screen, which no line leaves."""
    with screen_of(daemon, 40) as screen:
        text = screen.wait("^> turn left +70  not sent$", WAIT_S)
        assert all(len(line) <= 40 for line in text.splitlines())
        screen.keys("PPage", "PPage", "PPage", "PPage", "PPage", "PPage")
        screen.wait("^> turn left +120  sent$", WAIT_S)
        screen.keys("C-c")
        text = screen.wait("^exit code 130$", WAIT_S).replace("\n", "")
        assert "turn left 120; not saved: reset ends them; pause was sent" in text, text
    wait_for(lambda: state(double) == ["idle"], what="the robot to stand still")
    assert max(told[1] for told in calibrations(double)) == 120


def let_the_terminal_go_away(daemon, double):
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


def be_refused_and_lose_the_daemon(stack, daemon, double):
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


@needs_tmux
def test_a_robot_is_calibrated_on_the_screen_and_never_left_moving(stack):
    double = Double(stack, "--robots", 1)
    daemon = Daemon(stack, "daemon", kilobot_link(double.terminal, settle_ms=0,
                                                  time_scale=0.6)).wait_up()
    daemon.wait_link("table")
    change_and_save(daemon, double)
    leave_a_moving_robot(daemon, double)
    let_the_terminal_go_away(daemon, double)
    be_refused_and_lose_the_daemon(stack, daemon, double)
    last = double.end()
    assert last["robots"][0]["eeprom_uid"] == 12
    assert not last["repeating"]
    assert last["dangerous_frames"] == 0
