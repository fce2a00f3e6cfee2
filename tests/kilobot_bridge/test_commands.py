"""Commands through the daemon to the controller's double, in real time.

The bridge is told that time passes slowly for the controller: on a busy machine the double reads
late, and what a real controller would still hear is lost on it.
"""
import fcntl
import os
import pathlib
import pty
import signal
import subprocess
import termios
import time

import pytest
from table import IMAGES, Daemon, Double, kilobot_link, one_line, program, run, wait_for


def record(address: int, kind: int, data: bytes) -> str:
    body = bytes([len(data), address >> 8, address & 0xFF, kind]) + data
    return ":" + (body + bytes([-sum(body) & 0xFF])).hex().upper() + "\n"


def hex_file(folder, program: bytes):
    path = folder / f"program-{len(program)}.hex"
    path.write_text("".join(record(i, 0, program[i:i + 16]) for i in range(0, len(program), 16))
                    + record(0, 1, b""))
    return path


LINK = {"settle_ms": 0, "time_scale": 0.6}


def start_daemon(stack, double, *uplink, **keys):
    made = Daemon(stack, "daemon", kilobot_link(double.terminal, *uplink, **LINK, **keys)).wait_up()
    made.wait_link("table")
    wait_for(double.frame_types, what="the first STOP")
    return made


def states(double):
    return [e["state"] for e in double.events("robot", robot=0)]


def said(double):
    return [e["hex"] for e in double.events("infrared", damaged=False)]


def wait_stopped(double):
    wait_for(lambda: double.frame_types()[-2:] == [0, 0], what="STOP")


def send_messages(daemon, double):
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
    assert sum(each.startswith("01020300000000000009") for each in said(double)) >= 3
    assert daemon.kilobot("send", 9, "01:02", "--checksum", "0x1234").returncode == 0
    done = daemon.kilobot("position", "7,120,-45,90", "8,-32768,32767,-128")
    assert (done.returncode, done.stdout) == (0, "sent position\n"), done.stderr
    places = wait_for(lambda: [each for each in said(double) if each[18:20] == "01"][1:],
                      what="two positions")
    assert places[0].startswith("08000080ff7f800000" + "01")
    assert any(each.startswith("07007800d3ff5a0000" + "01") for each in said(double))
    assert "0102" + "00" * 7 + "09" + "3412" in said(double)


def refuse_what_the_daemon_refuses(daemon, double):
    before = double.frame_types()
    for words in (("send", 129), ("send", 9, "0102030405060708090a"), ("calibrate", "left", 121),
                  ("position", "0,0,0,0"), ("position", "7,40000,0,0"),
                  ("position", *["7,1,2,3"] * 257)):
        done = daemon.kilobot(*words)
        assert done.returncode == 1, words
        one_line(done.stderr, "swarmtalk-cli: ")
    assert double.frame_types() == before


def hold_a_message_until(daemon, double, stack, by):
    before = double.frame_types().count(2)
    cli = stack.start("held", *daemon.words("kilobot", "pause", "--hold", 0))
    wait_for(lambda: double.frame_types().count(2) >= before + 3, what="it, again and again")
    assert "until it is stopped" in daemon.link("table")["state"]
    one_line(daemon.kilobot("run").stderr, "busy with 'pause', until it is stopped")
    assert cli.end(by) == (128 + by if by == signal.SIGINT else -by)
    wait_stopped(double)
    if by == signal.SIGINT:
        one_line(cli.errors.read_text().splitlines()[0], "until Ctrl-C")
        one_line(cli.errors.read_text().splitlines()[1], "stopped; STOP was sent")
    wait_for(lambda: daemon.kilobot("send", 9, "01", "--hold", 0.3).stdout == "sent send\n",
             what="the line to be free")
    wait_stopped(double)


def give_up_reading_a_uid(daemon, double):
    ours, theirs = pty.openpty()
    cli = subprocess.Popen(daemon.words("kilobot", "read-uid"), stdin=theirs,
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                           start_new_session=True,
                           preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
    os.close(theirs)
    wait_for(lambda: cli.stdout.read(1) == "[", what="the question")
    stat = pathlib.Path(f"/proc/{cli.pid}/stat")
    wait_for(lambda: stat.read_text().rsplit(")", 1)[1].split()[0] == "S", what="it to listen")
    os.write(ours, b"\x03")
    _, errors = cli.communicate(timeout=60)
    os.close(ours)
    assert cli.returncode == 130, errors
    one_line(errors, "the uid is not known", "pause was sent")
    wait_for(lambda: states(double)[-1:] == ["idle"], what="the robots to stand still")


def publish_lines_of_the_uplink(daemon, stack, line):
    sub = stack.start("sub", *daemon.words("sub", 7, "--json"))
    wait_for(lambda: any(channel["subscribers"] for channel in daemon.status()["channels"]),
             what="the subscriber")
    os.write(line, b"light 512\r\n\n\xff\n" + b"x" * 300 + b"\n")
    wait_for(lambda: len(sub.lines()) == 3, what="the lines")
    texts = [bytes.fromhex(each["hex"]).decode() for each in sub.lines()]
    assert texts == ["light 512", "\N{REPLACEMENT CHARACTER}", "x" * 256]
    counters = daemon.link("table")["counters"]
    assert (counters["uplink_texts"], counters["uplink_lines_cut"]) == (3, 1)


def test_messages_reach_the_robots_and_are_ended_with_stop(stack):
    double = Double(stack, "--robots", 2)
    ours, theirs = pty.openpty()
    daemon = start_daemon(stack, double, os.ttyname(theirs), uplink_form="text", text_channel=7)
    os.close(theirs)
    send_messages(daemon, double)
    refuse_what_the_daemon_refuses(daemon, double)
    publish_lines_of_the_uplink(daemon, stack, ours)
    hold_a_message_until(daemon, double, stack, signal.SIGINT)
    give_up_reading_a_uid(daemon, double)
    thief = Daemon(stack, "thief", kilobot_link(double.terminal))
    wait_for(lambda: not thief.process.is_running(), what="the second daemon's end")
    assert thief.process.process.returncode == 1
    one_line(thief.process.errors.read_text(), "thief.toml:", "links.table.downlink",
             "another program has it open")
    # A daemon that ends leaves no controller repeating.
    stack.start("wakeup", *daemon.words("kilobot", "wakeup"))
    wait_for(lambda: double.frame_types()[-1] == 2, what="the message")
    daemon.process.end()
    os.close(ours)  # not before: the daemon would open the next terminal of that name
    wait_for(lambda: double.frame_types()[-1] == 0, what="STOP")
    time.sleep(0.1)  # the pass in hand, 10.4 ms, goes on to its end
    state = double.end()
    assert [robot["eeprom_uid"] for robot in state["robots"]] == [1234, 1234]
    assert not state["repeating"]
    assert state["dangerous_frames"] == 0
    assert not any(robot["bootloader_damaged"] for robot in state["robots"])


def interrupt_an_endless_program(daemon, double, stack, path):
    cli = stack.start("program", *daemon.words("kilobot", "program", path, "--passes", 0,
                                               "--force"))
    wait_for(lambda: 4 in double.frame_types(), what="a page")
    done = daemon.cli("pub", 0, "hi")
    assert done.returncode == 1
    one_line(done.stderr, "sends 'program'", "left")
    one_line(daemon.kilobot("run").stderr, "busy with 'program'", "kilobot stop")
    before = len(double.frame_types())
    assert cli.end(signal.SIGINT) == 128 + signal.SIGINT
    wait_for(lambda: double.frame_types()[-1] == 0, what="STOP")
    assert len(double.frame_types()) <= before + 4
    assert "STOP was sent" in cli.errors.read_text()
    assert "bootloader" in cli.errors.read_text()
    daemon.wait_link("table")
    assert daemon.cli("pub", 0, "hi").returncode == 0


def wait_in_the_bootloader(daemon, double):
    pages = double.frame_types().count(4)
    done = daemon.kilobot("bootload")
    assert done.returncode == 0, done.stderr
    assert "sent bootload; robots that flash blue wait" in done.stdout
    assert states(double)[-1] == "bootloader"
    assert double.frame_types().count(4) == pages, "pages are not sent"
    assert daemon.kilobot("run").returncode == 0
    wait_for(lambda: states(double)[-1] == "running", what="the old program")


@pytest.mark.field
def test_programs_reach_the_robots_whole_or_are_ended_with_stop(stack, tmp_path):
    flash = tmp_path / "flash.bin"
    double = Double(stack, "--robots", 2, "--dump-flash", flash)
    daemon = start_daemon(stack, double)
    hold_a_message_until(daemon, double, stack, signal.SIGKILL)
    wait_in_the_bootloader(daemon, double)
    interrupt_an_endless_program(daemon, double, stack, hex_file(tmp_path, bytes(4096)))
    image = bytes((7 * i + 3) % 256 for i in range(300))
    done = daemon.kilobot("program", hex_file(tmp_path, image), "--passes", 3, "--force")
    assert done.returncode == 0, done.stderr
    assert "sent 3 passes" in done.stdout and "done" not in done.stdout
    assert "pass 3 of 3" in done.stderr and "0:0" in done.stderr
    assert daemon.kilobot("run").returncode == 0
    wait_for(lambda: states(double)[-1] == "running", what="the new program")
    # The controller is unplugged while something is sent, and another is there later.
    cli = stack.start("held", *daemon.words("kilobot", "pause", "--hold", 0))
    wait_for(lambda: "until it is stopped" in daemon.link("table")["state"], what="the message")
    state = double.end()
    assert flash.read_bytes()[:300] == image
    assert state["robots"][0]["starts"] >= 2, "the program began anew"
    assert state["dangerous_frames"] == 0
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


def refused(*words):
    """What a command says that needs no daemon to be refused."""
    done = run(program("swarmtalk-cli"), "--socket", "/nonexistent/daemon", "kilobot", *words)
    assert done.returncode in (1, 2, 3), (words, done.stderr)
    one_line(done.stderr, "swarmtalk-cli: ")
    return done.stderr


@pytest.mark.logic
def test_a_bad_hex_file_gets_one_line_and_nothing_is_sent(tmp_path):
    good, end = record(0, 0, b"\1\2"), record(0, 1, b"")
    bad = {
        "checksum": (good[:-3] + "00\n" + end, "line 1", "checksum"),
        "overlap": (good + record(1, 0, b"\7") + end, "line 2", "another value"),
        "missing end": (good, "no end record"),
        "too long": (record(0x6DFF, 0, b"\1\2") + end, "line 1", "bootloader"),
        "no hex": ("hello\n", "not an Intel HEX file"),
    }
    path = tmp_path / "bad.hex"
    for text, *parts in bad.values():
        path.write_text(text)
        one_line(refused("program", path), str(path), *parts)
    path.write_text(good + end)
    one_line(refused("program", path), str(path), "too short")
    one_line(refused("program", tmp_path / "none.hex"), "No such file")
    one_line(refused("program", tmp_path), str(tmp_path))


CONTROLLERS = ["overhead_arduino", "overhead_arduino_16mhz"]


@pytest.mark.logic
def test_of_our_images_the_robots_programs_are_taken_and_the_controllers_are_not():
    """A table that was given a controller's image would take no other program any more."""
    images = sorted(IMAGES.glob("*.hex"))
    names = [path.stem for path in images]
    if not names:
        pytest.skip("no images: avr-gcc is missing, run tools/setup test")
    assert set(CONTROLLERS) <= set(names) and len(names) > 5
    for path in images:
        said = refused("program", path)
        if path.stem in CONTROLLERS:
            one_line(said, str(path), "hears no infrared light", "--force")
        elif "bootloader" not in said:  # which lies elsewhere
            one_line(said, "cannot reach swarmtalkd")


@pytest.mark.logic
@pytest.mark.parametrize("words", [
    ("set-uid", 65536), ("calibrate", "left", 256), ("send", 9, "xyz"), ("program",), ("walk",),
    (), ("send", 9, "01", "--checksum", "12"), ("run", "--hold", "x"), ("run", "--hold", 0.01),
    ("run", "--hold", 3601), ("led", "--hold", 1), ("position",), ("position", "7,1,2"),
    ("position", "7,1,2,3,"), ("position", "7,1,2,x"), ("position", "-1,1,2,3")])
def test_a_wrong_command_line_gets_one_line(words):
    text = refused(*words)
    if words == ("walk",):
        one_line(text, "see swarmtalk-cli kilobot --help")


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
