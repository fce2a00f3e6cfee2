"""Commands through the daemon to the controller's double, in real time.

The bridge is told that time passes slowly for the controller: on a busy machine the double reads
late, and what a real controller would still hear is lost on it.
"""
import fcntl
import os
import pty
import signal
import subprocess
import termios
import time

import pytest
from table import Daemon, Double, kilobot_link, one_line, program, run, wait_for


def record(address: int, kind: int, data: bytes) -> str:
    body = bytes([len(data), address >> 8, address & 0xFF, kind]) + data
    return ":" + (body + bytes([-sum(body) & 0xFF])).hex().upper() + "\n"


def hex_file(folder, program: bytes):
    path = folder / "program.hex"
    path.write_text("".join(record(i, 0, program[i:i + 16]) for i in range(0, len(program), 16))
                    + record(0, 1, b""))
    return path


LINK = {"settle_ms": 0, "time_scale": 0.6}


@pytest.fixture
def double(stack):
    return Double(stack, "--robots", 2)


@pytest.fixture
def daemon(stack, double):
    made = Daemon(stack, "daemon", kilobot_link(double.terminal, **LINK)).wait_up()
    made.wait_link("table")
    wait_for(double.frame_types, what="the first STOP")
    return made


def states(double):
    return [e["state"] for e in double.events("robot", robot=0)]


def test_robots_run_pause_and_keep_a_uid(daemon, double):
    done = daemon.kilobot("run")
    assert (done.returncode, done.stdout) == (0, "sent run\n"), done.stderr
    assert daemon.kilobot("pause").stdout == "sent pause\n"
    done = daemon.kilobot("set-uid", 1234)
    one_line(done.stderr, "warning", "one robot in the light")
    assert daemon.kilobot("send", 9, "01:02:03").returncode == 0
    assert "sent led" in daemon.kilobot("led").stdout
    assert daemon.kilobot("stop").stdout == "sent stop\n"
    wait_for(lambda: double.frame_types()[-1] == 0, what="the last STOP")
    assert states(double)[:2] == ["running", "idle"]
    message = "01020300000000000009"
    assert len([e for e in double.events("infrared", damaged=False)
                if e["hex"].startswith(message)]) >= 3
    state = double.end()
    assert [robot["eeprom_uid"] for robot in state["robots"]] == [1234, 1234]
    assert not state["repeating"]
    assert state["dangerous_frames"] == 0
    assert not any(robot["bootloader_damaged"] for robot in state["robots"])


def test_robots_wait_in_their_bootloader_for_a_program(daemon, double):
    done = daemon.kilobot("bootload")
    assert done.returncode == 0, done.stderr
    assert "sent bootload; robots that flash blue wait" in done.stdout
    assert states(double) == ["bootloader"]
    assert 4 not in double.frame_types(), "pages are not sent"
    assert daemon.kilobot("run").returncode == 0
    wait_for(lambda: states(double)[-1] == "running", what="the old program")
    assert double.end()["dangerous_frames"] == 0


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGKILL])
def test_a_held_message_is_said_anew_until_it_is_stopped(stack, daemon, double, by):
    cli = stack.start("held", *daemon.words("kilobot", "pause", "--hold", 0))
    wait_for(lambda: double.frame_types().count(2) >= 3, what="the message, again and again")
    assert "until it is stopped" in daemon.link("table")["state"]
    one_line(daemon.kilobot("run").stderr, "busy with 'pause', until it is stopped")
    assert cli.end(by) == (128 + by if by == signal.SIGINT else -by)
    wait_for(lambda: double.frame_types()[-2:] == [0, 0], what="STOP")
    if by == signal.SIGINT:
        one_line(cli.errors.read_text().splitlines()[0], "until Ctrl-C")
        one_line(cli.errors.read_text().splitlines()[1], "stopped; STOP was sent")
    assert daemon.kilobot("send", 9, "01", "--hold", 1.5).stdout == "sent send\n"
    wait_for(lambda: double.frame_types()[-2:] == [0, 0], what="STOP")
    assert not double.end()["repeating"]


def test_a_checksum_of_ones_own_and_positions_reach_the_air(daemon, double):
    assert daemon.kilobot("send", 9, "01:02", "--checksum", "0x1234").returncode == 0
    done = daemon.kilobot("position", "7,120,-45,90", "8,-32768,32767,-128")
    assert (done.returncode, done.stdout) == (0, "sent position\n"), done.stderr
    said = wait_for(lambda: [e["hex"] for e in double.events("infrared", damaged=False)
                             if e["hex"][18:20] == "01"][1:], what="two positions")
    assert said[0].startswith("08000080ff7f800000" + "01")
    said = {e["hex"] for e in double.events("infrared", damaged=False)}
    assert any(each.startswith("07007800d3ff5a0000" + "01") for each in said), said
    assert "0102" + "00" * 7 + "09" + "3412" in said
    assert double.end()["dangerous_frames"] == 0


def test_a_program_is_loaded_byte_for_byte(stack, daemon, tmp_path):
    daemon.process.end()
    flash = tmp_path / "flash.bin"
    double = Double(stack, "--robots", 1, "--dump-flash", flash)
    program = bytes((7 * i + 3) % 256 for i in range(1000))
    daemon = Daemon(stack, "second", kilobot_link(double.terminal, **LINK)).wait_up()
    daemon.wait_link("table")
    done = daemon.kilobot("program", hex_file(tmp_path, program), "--passes", 3)
    assert done.returncode == 0, done.stderr
    assert "sent 3 passes" in done.stdout and "done" not in done.stdout
    assert "pass 3 of 3" in done.stderr and "0:0" in done.stderr
    assert daemon.kilobot("run").returncode == 0
    state = double.end()
    assert flash.read_bytes()[:1000] == program
    assert state["robots"][0]["state"] == "running"
    assert state["robots"][0]["starts"] == 2, "the program began anew"
    assert state["dangerous_frames"] == 0


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_program_ends_with_stop(stack, daemon, double, tmp_path, by):
    path = hex_file(tmp_path, bytes(range(256)) * 16)
    cli = stack.start("program", *daemon.words("kilobot", "program", path, "--passes", 0))
    wait_for(lambda: 4 in double.frame_types(), what="a page")
    before = len(double.frame_types())
    code = cli.end(by)
    wait_for(lambda: double.frame_types()[-1] == 0, timeout=5, what="STOP")
    assert len(double.frame_types()) <= before + 4
    if by == signal.SIGINT:
        assert code == 128 + by
        assert "STOP was sent" in cli.errors.read_text()
        assert "bootloader" in cli.errors.read_text()
    wait_for(lambda: daemon.kilobot("run").returncode == 0, what="the line to be free")


def test_messages_and_programming_exclude_each_other(stack, daemon, double, tmp_path):
    path = hex_file(tmp_path, bytes(4096))
    stack.start("program", *daemon.words("kilobot", "program", path, "--passes", 0))
    wait_for(lambda: 4 in double.frame_types(), what="a page")
    done = daemon.cli("pub", 0, "hi")
    assert done.returncode == 1
    one_line(done.stderr, "sends 'program'", "left")
    one_line(daemon.kilobot("run").stderr, "busy with 'program'", "kilobot stop")
    assert daemon.kilobot("stop").returncode == 0, "stop ends another's command"
    daemon.wait_link("table")
    assert daemon.cli("pub", 0, "hi").returncode == 0
    assert double.end()["dangerous_frames"] == 0


def test_a_bad_hex_file_gets_one_line_and_nothing_is_sent(daemon, double, tmp_path):
    good, end = record(0, 0, b"\1\2"), record(0, 1, b"")
    bad = {
        "checksum": (good[:-3] + "00\n" + end, "line 1", "checksum"),
        "overlap": (good + record(1, 0, b"\7") + end, "line 2", "another value"),
        "missing end": (good, "no end record"),
        "too long": (record(0x6DFF, 0, b"\1\2") + end, "line 1", "bootloader"),
        "no hex": ("hello\n", "not an Intel HEX file"),
    }
    before = double.frame_types()
    path = tmp_path / "bad.hex"
    for text, *parts in bad.values():
        path.write_text(text)
        done = daemon.kilobot("program", path)
        assert done.returncode == 1
        one_line(done.stderr, str(path), *parts)
    one_line(daemon.kilobot("program", tmp_path / "none.hex").stderr, "No such file")
    one_line(daemon.kilobot("program", tmp_path).stderr, str(tmp_path))
    for words in (("send", 129), ("send", 9, "0102030405060708090a"), ("set-uid", 65536),
                  ("calibrate", "left", 121), ("calibrate", "left", 256), ("send", 9, "xyz"),
                  ("program",), ("walk",), (), ("send", 9, "01", "--checksum", "12"),
                  ("run", "--hold", "x"), ("run", "--hold", 0.01), ("run", "--hold", 3601),
                  ("led", "--hold", 1), ("position",), ("position", "7,1,2"),
                  ("position", "7,1,2,3,"), ("position", "7,1,2,x"), ("position", "-1,1,2,3"),
                  ("position", "0,0,0,0"), ("position", "7,40000,0,0"),
                  ("position", *["7,1,2,3"] * 257)):
        done = daemon.kilobot(*words)
        assert done.returncode in (1, 2), words
        one_line(done.stderr, "swarmtalk-cli: ")
    one_line(daemon.kilobot("walk").stderr, "see swarmtalk-cli kilobot --help")
    assert double.frame_types() == before


@pytest.mark.parametrize("key, code", [(b"\x03", 130), (b"\x04", 1)])
def test_read_uid_on_a_terminal_lets_no_robot_turn_on(daemon, double, key, code):
    ours, theirs = pty.openpty()
    cli = subprocess.Popen(daemon.words("kilobot", "read-uid"), stdin=theirs,
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                           start_new_session=True,
                           preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
    os.close(theirs)
    wait_for(lambda: cli.stdout.read(1) == "[", what="the question")
    os.write(ours, key)
    _, errors = cli.communicate(timeout=30)
    os.close(ours)
    assert cli.returncode == code, errors
    one_line(errors, "the uid is not known", "pause was sent")
    wait_for(lambda: states(double)[-1:] == ["idle"], what="the robots to stand still")


def test_unplugging_under_load_ends_the_command_with_one_line(stack, daemon, double, tmp_path):
    path = hex_file(tmp_path, bytes(4096))
    cli = stack.start("program", *daemon.words("kilobot", "program", path, "--passes", 0))
    wait_for(lambda: 4 in double.frame_types(), what="a page")
    double.end()
    wait_for(lambda: not cli.is_running(), what="the command's end")
    assert cli.process.returncode == 1
    assert "is lost" in cli.errors.read_text().splitlines()[-1]
    warnings = [line for line in daemon.process.errors.read_text().splitlines()
                if "warning" in line]
    assert len(warnings) == 1 and "is lost" in warnings[0], warnings
    one_line(daemon.kilobot("run").stderr, "no overhead controller at")
    assert "no overhead controller" in daemon.link("table")["state"]
    again = Double(stack, "--robots", 1)
    daemon.wait_link("table")
    assert daemon.kilobot("run").returncode == 0
    assert again.frame_types()[0] == 0, "STOP comes first"


def test_lines_of_a_text_uplink_are_published(stack):
    ours, theirs = pty.openpty()
    path = os.ttyname(theirs)
    config = kilobot_link(None, path, uplink_form="text", text_channel=7)
    daemon = Daemon(stack, "daemon", config).wait_up()
    os.close(theirs)
    sub = stack.start("sub", *daemon.words("sub", 7, "--json"))
    wait_for(lambda: any(channel["subscribers"] for channel in daemon.status()["channels"]),
             what="the subscriber")
    os.write(ours, b"light 512\r\n\n\xff\n" + b"x" * 300 + b"\n")
    wait_for(lambda: len(sub.lines()) == 3, what="the lines")
    os.close(ours)
    said = [bytes.fromhex(line["hex"]).decode() for line in sub.lines()]
    assert said == ["light 512", "\N{REPLACEMENT CHARACTER}", "x" * 256]
    counters = daemon.link("table")["counters"]
    assert (counters["uplink_texts"], counters["uplink_lines_cut"]) == (3, 1)


def test_a_second_daemon_does_not_get_the_device(stack, daemon, double):
    second = Daemon(stack, "thief", kilobot_link(double.terminal))
    wait_for(lambda: not second.process.is_running(), what="the second daemon's end")
    assert second.process.process.returncode == 1
    one_line(second.process.errors.read_text(), "thief.toml:", "links.table.downlink",
             "another program has it open")
    assert daemon.kilobot("run").returncode == 0


def test_a_daemon_that_ends_leaves_no_controller_repeating(stack, daemon, double):
    stack.start("wakeup", *daemon.words("kilobot", "wakeup"))
    wait_for(lambda: double.frame_types()[-1] == 2, what="the message")
    daemon.process.end()
    wait_for(lambda: double.frame_types()[-1] == 0, what="STOP")
    time.sleep(0.1)  # the pass in hand, 10.4 ms, goes on to its end
    assert not double.end()["repeating"]


@pytest.mark.logic
@pytest.mark.parametrize("keys, parts", [
    ({"downlink": None}, ("downlink", "overhead controller")),
    ({"downlink": "ttyUSB0"}, ("downlink", "by-id")),
    ({"downlink": "/dev/null"}, ("downlink", "not a serial device")),
    ({"copies": 0}, ("copies", "1")),
    ({"time_scale": 0}, ("time_scale",)),
    ({"ohc_single": 1}, ("ohc_single", "true or false")),
    ({"uplink_form": "text"}, ("uplink",)),
    ({"interface": "wlan0"}, ("interface",)),
    ({"profile": "wifi"}, ("profile", "kilobot")),
])
def test_a_wrong_configuration_gets_one_line(tmp_path, keys, parts):
    config = kilobot_link(**{"downlink": "/dev/swarmtalk-none", **keys})
    if "profile" in keys:
        config = config.replace('profile = "kilobot"\n', "", 1)
    path = tmp_path / "wrong.toml"
    path.write_text(f'[socket]\npath = "{tmp_path}/s"\n{config}')
    done = run(program("swarmtalkd"), "--config", path)
    assert done.returncode == 1
    one_line(done.stderr, "wrong.toml:", *parts)
