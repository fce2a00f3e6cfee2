"""What a person sees on a terminal: the screens of top and radar, through tmux; help and tables
that fit it; bold headings."""
import fcntl
import os
import pty
import re
import signal
import struct
import subprocess
import termios

import pytest
from conftest import program
from tmux import Tmux, needs_tmux


def on_terminal(columns, tool, *words):
    """What a command prints on a terminal so wide."""
    pid, terminal = pty.fork()
    if pid == 0:
        fcntl.ioctl(1, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        os.environ.update(TERM="xterm")
        os.environ.pop("NO_COLOR", None)
        os.execv(tool, [os.path.basename(tool), *map(str, words)])
    text = b""
    while True:
        try:
            part = os.read(terminal, 4096)
        except OSError:
            part = b""
        if not part:
            break
        text += part
    os.close(terminal)
    assert os.waitpid(pid, 0)[1] == 0
    return text.decode().replace("\r", "")


def headings_are_bold_on_a_terminal(lab):
    tool, socket = program("swarmtalk-cli"), ("--socket", lab.state()[0]["socket"])
    for columns in (40, 200):
        text = on_terminal(columns, tool, *socket, "status")
        assert "\x1b[1mLINK" in text and "u001b" not in text, text
    assert "\x1b" not in lab.cli(1, "status").stdout


@pytest.mark.logic
@pytest.mark.parametrize("columns", [40, 80])
@pytest.mark.parametrize("tool", ["swarmtalk-cli", "swarmtalk-lab", "swarmtalk-view", "swarmtalkd"])
def test_help_is_folded_where_a_line_is_full(tool, columns):
    lines = on_terminal(columns, program(tool), "--help").splitlines()
    assert len(lines) > 5
    begin = next(i for i, line in enumerate(lines) if line.startswith("Usage:"))
    assert all(len(line) <= columns for line in lines), lines
    for line, below in zip(lines[begin:], lines[begin + 1:]):
        is_prose = line and below and line[0] != " " and below[0] != " "
        if is_prose and not line.endswith((".", ":")):
            word = below.split()[0]
            assert len(line) + 1 + len(word) > columns, f"{word!r} fits behind {line!r}"


def in_robot(lab, robot, *words):
    return " ".join([program("swarmtalk-lab"), "--name", lab.name, "exec", str(robot), "--",
                     program("swarmtalk-cli"), *words])


def top_and_radar_fit_the_terminal_and_obey_keys(lab, width):
    with Tmux(width, 24, in_robot(lab, 3, "top")) as screen:
        text = screen.wait("^alarm +[0-9]")
        for head in ("^CHANNEL +MSG/S", "^PROGRAM", "^NEIGHBOUR", "^4711 +[0-9]", "^q quit"):
            assert re.search(head, text, re.M), text
        assert ("ROBOTS" in text) == (width == 80), text
        assert all(len(line) <= width for line in text.splitlines())
        screen.keys("s")
        screen.wait("sort:rate")
        screen.keys("/")
        screen.keys("ala", "Enter")
        text = screen.wait("filter:ala")
        assert "4711" not in text and "alarm" in text, text
        screen.keys("/")
        screen.keys("-l", "x\u00e4")
        screen.wait("filter: x\u00e4_")
        screen.keys("BSpace")
        screen.wait("filter: x_ *$")
        screen.keys("Enter", "q")
        screen.wait("^exit code 0$")
    with Tmux(width, 24, in_robot(lab, 3, "radar", "--range", "1")) as screen:
        text = screen.wait(r"^2 heard; rings at 0\.50 m and 1\.00 m$")
        assert re.search(r"\^.*$", text, re.M) and re.search(r"[ .]2[ .~?]", text), text
        screen.keys("+")
        screen.wait(r"rings at 0\.25 m and 0\.50 m$")
        screen.keys("C-c")
        screen.wait("^exit code 130$")


def a_daemon_that_dies_ends_radar_with_one_line(lab):
    with (Tmux(80, 24, in_robot(lab, 3, "radar")) as wide,
          Tmux(40, 24, in_robot(lab, 3, "radar")) as narrow):
        for screen in (wide, narrow):
            screen.wait("^2 heard")
        os.kill(lab.pid(3), signal.SIGKILL)
        for screen in (wide, narrow):
            text = screen.wait("^exit code 3$")
            assert "swarmtalkd closed the connection" in text.replace("\n", ""), text


def once_fits_the_terminal(lab):
    for verb in ("top", "radar"):
        with Tmux(40, 60, in_robot(lab, 3, verb, "--once")) as screen:
            screen.wait("^exit code 0$")
            lines = [line.rstrip() for line in screen.whole_lines()]
            assert max(len(line) for line in lines) <= 40, lines


def channels_fit_the_terminal(lab):
    with Tmux(40, 60, in_robot(lab, 3, "channels", "-W", "1")) as screen:
        screen.wait("^exit code 0$")
        lines = [line.rstrip() for line in screen.whole_lines()]
        assert max(len(line) for line in lines) <= 40, lines
        assert "CHANNEL  alarm" in lines and "ROBOTS  1" in lines
    with Tmux(100, 60, in_robot(lab, 3, "channels", "-W", "1")) as screen:
        assert re.search("^CHANNEL +NUMBER +MSG/S .*ROBOTS *$", screen.wait("^exit code 0$"), re.M)


def the_keys_are_seen_on_a_low_terminal(lab):
    with Tmux(60, 8, in_robot(lab, 3, "top")) as screen:
        text = screen.wait("^CHANNEL")
        assert text.splitlines()[7].startswith("q quit"), text


def arrows_move_what_is_too_long_for_the_terminal(lab):
    sub = lab.start(3, program("swarmtalk-cli"), "sub", *"123456")
    try:
        with Tmux(60, 16, in_robot(lab, 3, "top")) as screen:  # five lines for the channels
            screen.wait("^1 .*\n2 .*\n3 .*\n +and 5 more: arrow down$")
            screen.keys("Down")
            screen.wait("^CHANNEL.*\n2 .*\n3 .*\n4 .*\n +and 4 more, 1 above$")
            screen.keys("PageDown")  # the next that were not seen
            screen.wait("^CHANNEL.*\n4711 .*\n5 .*\n6 .*\n +and 1 more, 4 above$")
            screen.keys("PageDown", "PageDown")  # no farther than there is something
            screen.wait("^CHANNEL.*\n5 .*\n6 .*\nalarm .*\n +5 above$")
            screen.keys("Up")
            screen.wait("^CHANNEL.*\n4711 .*\n5 .*\n6 .*\n +and 1 more, 4 above$")
            screen.keys("PageUp", "PageUp", "k")
            screen.wait("^1 .*\n2 .*\n3 .*\n +and 5 more: arrow down$")
            screen.keys("Down", "s")  # another order begins at its beginning
            screen.wait("^CHANNEL.*\n.*\n.*\n.*\n +and 5 more: arrow down$")
        with Tmux(60, 24, in_robot(lab, 3, "top")) as screen:  # what others need less, it has
            screen.wait("^1 .*\n2 .*\n3 .*\n4 .*\n4711 .*\n5 .*\n6 .*\nalarm .*\n\nPROGRAM")
    finally:
        sub.terminate()
        sub.wait(60)


def a_terminal_that_cannot_be_drawn_on_is_told(lab):
    for verb in ("top", "radar"):
        with Tmux(200, 24, "TERM=dumb " + in_robot(lab, 3, verb)) as screen:
            text = screen.wait("^exit code 1$")
            assert f"set TERM to its kind, as in TERM=xterm; {verb} --once" in text, text


def a_terminal_that_goes_away_ends_top(lab):
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm"}
    words = in_robot(lab, 3, "top").split()
    process = subprocess.Popen(words, stdin=theirs, stdout=theirs, stderr=subprocess.PIPE,
                               env=environment, start_new_session=True)
    os.close(theirs)
    assert os.read(ours, 10)
    os.close(ours)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 0 and errors == b"", errors  # as if it had been left


@needs_tmux
def test_screens_fit_the_terminal_and_obey_keys(talking_lab):
    for width in (80, 40):
        top_and_radar_fit_the_terminal_and_obey_keys(talking_lab, width)
    the_keys_are_seen_on_a_low_terminal(talking_lab)
    arrows_move_what_is_too_long_for_the_terminal(talking_lab)
    a_daemon_that_dies_ends_radar_with_one_line(talking_lab)


@needs_tmux
def test_what_is_printed_fits_the_terminal(talking_lab):
    for look in (headings_are_bold_on_a_terminal, once_fits_the_terminal, channels_fit_the_terminal,
                 a_terminal_that_cannot_be_drawn_on_is_told, a_terminal_that_goes_away_ends_top):
        look(talking_lab)
