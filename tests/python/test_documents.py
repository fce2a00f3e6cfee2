"""The Python in the documents and the example programs run as they stand there, and the defaults
that the documents name are those of the code."""
import inspect
import os
import pathlib
import re
import signal
import subprocess
import threading
import time

import pytest
from conftest import ROOT, find_python
from daemons import CLIENT

import daemons
import swarmtalk

LONGEST_S = 60  # of a block that ends by itself; others are interrupted when they have printed


def blocks(document):
    text = (ROOT / document).read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.S)


BLOCKS = [(f"{document.split('/')[-1].split('.')[0]}_{number}", block)
          for document in ("README.md", "docs/python.md")
          for number, block in enumerate(blocks(document), 1)]
# The script that the block for coach-os runs, and coach-os.
COACHBOT = """
class robot:
    get_pose = staticmethod(lambda: (1, 2, 3))
"""
SCRIPT = "def usr(robot):\n    print(robot.send_msg(b'x'), robot.get_pose())\n"


# What the daemon does with an option that a program leaves out.
LEFT_OUT = {"ttl": 0}


@pytest.mark.logic
@pytest.mark.parametrize("method", [swarmtalk.Client.advertise, swarmtalk.Client.subscribe],
                         ids=["advertise", "subscribe"])
def test_the_options_and_defaults_of_the_manual_are_those_of_the_code(method):
    text = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    table = text.split(f"| `{method.__name__}(channel", 1)[1].split("\n\n")[0]
    shown = {"channel": ""}
    for names in re.findall(r"^\| (`.*?) \|", table.split("\n", 2)[2], re.M):
        shown.update(re.findall(r"`(\w+)(?:=(\S+?))?`", names))
    code = inspect.signature(inspect.unwrap(method_of(method))).parameters
    assert set(shown) == set(code) - {"self"}
    for name, default in shown.items():
        if default:
            told = code[name].default
            assert default == repr(LEFT_OUT[name] if told is None and name in LEFT_OUT else told)


def method_of(guarded):
    """The function behind what _owned() made of it."""
    return inspect.getclosurevars(guarded).nonlocals["method"]


@pytest.mark.logic
def test_the_limits_and_switches_of_the_manual_are_those_of_the_code():
    text = " ".join((ROOT / "docs/python.md").read_text(encoding="utf-8").split())
    assert f"wait in the subscriber, at most {swarmtalk.MESSAGES_THAT_WAIT};" in text
    installed = (ROOT / "systemd/swarmtalkd.toml").read_text(encoding="utf-8")
    switches = dict(re.findall(r"^(\w+) = (\w+)$", installed.split("[reserved]")[1], re.M))
    says = {"true": "on", "false": "off"}
    assert (f"As installed, `harvest` is {says[switches.get('harvest', 'false')]} and `debug` is "
            f"{says[switches.get('debug', 'false')]}") in text
    rows = (ROOT / "docs/configuration.md").read_text(encoding="utf-8")
    rows = rows.split("## `[reserved]`")[1].split("\n## ")[0]
    for key in ("debug", "harvest", "report"):
        row = re.search(rf"^\| `{key}` \|.*$", rows, re.M).group()
        assert ("true in the installed file" in row) == (switches.get(key) == "true"), row


class Chatter(threading.Thread):
    """Another robot, that says hello all the time."""

    def __init__(self, socket):
        super().__init__()
        self.socket = socket
        self.listens, self.ended = threading.Event(), threading.Event()
        self.heard = []

    def run(self):
        with swarmtalk.Client("chatter", self.socket) as robot:
            robot.set_fixed_pose(1, 1, 0)
            hello, here = robot.advertise("hello"), robot.advertise("here")
            robot.subscribe("hello", lambda message: self.heard.append(message.text))
            self.listens.set()
            harvest = swarmtalk.Harvest(robot)
            harvest.set("battery", "3.7")
            while not self.ended.is_set():
                hello.send("hello from the other robot")
                here.send("")
                robot.run(0.05)


@pytest.fixture
def two_robots():
    with daemons.Daemons(2, "[reserved]\ndebug = true\nharvest = true\n") as robots:
        yield robots


@pytest.fixture
def chatter(two_robots):
    thread = Chatter(two_robots[1].socket)
    thread.start()
    assert thread.listens.wait(60)
    yield thread
    thread.ended.set()
    thread.join(30)


def command_of(example, language):
    if language == "cpp":
        return [pathlib.Path(daemons.BUILD) / "examples/cpp" / example]
    return [find_python(language), "-u", ROOT / f"examples/python/{example}.py"]


def run_until_it_prints(socket, *command, wanted=".", cwd=None, is_enough=lambda: True,
                        is_heard=None):
    """What the program prints until the pattern is found in it; it is interrupted then, as soon as
    that is enough. is_heard: set when it says that robot 9 leads."""
    process = subprocess.Popen(
        [*map(str, command)], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, cwd=cwd,
        env={**os.environ, "PYTHONPATH": CLIENT, "SWARMTALK_SOCKET": socket,
             "PYTHONDONTWRITEBYTECODE": "1"})
    watchdog = threading.Timer(LONGEST_S, process.kill)
    watchdog.start()
    out = ""
    for line in process.stdout:
        out += line
        if is_heard is not None and "9 leads" in line:
            is_heard.set()
        if re.search(wanted, out) and is_enough() and process.poll() is None:
            process.send_signal(signal.SIGINT)
            break
    rest, errors = process.communicate()
    watchdog.cancel()
    assert process.returncode != -signal.SIGKILL, out + rest + errors
    # Interrupted is the only way to end badly; without a word where Python was ending by itself.
    assert process.returncode in (0, -signal.SIGINT) or (
        errors.rstrip().endswith("KeyboardInterrupt")), errors
    assert "swarmtalk:" not in errors and "never retrieved" not in errors, errors
    return out + rest


def run_a_block(name, block, two_robots, tmp_path):
    prelude = "" if "import swarmtalk\n" in block else "import swarmtalk\n"
    if "Client(" not in block:
        prelude += "robot = swarmtalk.Client('block')\n"
    if "run_script" in block:
        (tmp_path / "usr_code.py").write_text(SCRIPT)
        prelude = COACHBOT
        block = block.replace("/home/pi/control/usr_code.py", str(tmp_path / "usr_code.py"))
    program = tmp_path / "block.py"
    program.write_text(prelude + block)
    is_quiet = "too fast" in block  # prints when something is wrong
    if is_quiet:
        program.write_text(prelude + block + "print('end')\n")
    with swarmtalk.Client("pose", two_robots[0].socket) as robot:
        robot.set_fixed_pose(1, 0.6, 0)
        robot.sync()
    assert run_until_it_prints(two_robots[0].socket, "/usr/bin/python3", "-u", program), (
        f"{name} printed nothing")


EXAMPLES = {
    "chatter": r"robot 2 says hello from the other robot, 0.40 m away",
    "near": r"robot 1: 2 at 0.40 m",
    "leader": r"robot 1: robot 9 leads\nrobot 1: I lead",
    "follow": r"robot 2 is nearest, 0.40 m away at 90 degrees\nleft 5, right 35",
}


def run_an_example(name, language, two_robots, chatter):
    chatter.heard.clear()
    with swarmtalk.Client("pose", two_robots[0].socket) as robot:
        robot.set_fixed_pose(1, 0.6, 0)
        robot.sync()
        is_heard = threading.Event()
        if name == "leader":
            threading.Thread(target=claim, args=(two_robots[1].socket, is_heard)).start()
        try:
            out = run_until_it_prints(two_robots[0].socket, *command_of(name, language),
                                      wanted=EXAMPLES[name], is_heard=is_heard,
                                      is_enough=lambda: name != "chatter" or chatter.heard)
        finally:
            is_heard.set()
    assert re.search(EXAMPLES[name], out), (name, language, out)
    if name == "chatter":
        assert chatter.heard[0] == "hello 1"


def claim(socket, is_heard):
    """Robot 9 tells that it is there, over robot 2, until somebody has heard it."""
    with swarmtalk.Client("claim", socket) as robot:
        publisher = robot.advertise("leader")
        while not is_heard.wait(0.1):
            publisher.send(b"\x09\0\0\0")


def write_a_table(language, two_robots, tmp_path):
    table = tmp_path / f"{language}.csv"
    process = subprocess.Popen(
        [*command_of("log_to_csv", language), table, "hello"],
        env={**os.environ, "PYTHONPATH": CLIENT, "SWARMTALK_SOCKET": two_robots[0].socket})
    deadline = time.monotonic() + LONGEST_S
    while not table.exists() or table.read_text().count("\n") < 4:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    assert process.wait(LONGEST_S) == 0
    header, first, *_ = table.read_text().splitlines()
    cells = dict(zip(header.split(","), first.split(",")))
    assert cells["channel"] == "hello" and cells["sender"] == "2" and cells["distance_m"] == ""
    assert bytes.fromhex(cells["hex"]) == b"hello from the other robot"
    assert abs(float(cells["time"]) - time.time()) < LONGEST_S


def test_the_documents_blocks_and_the_examples_run(two_robots, chatter, tmp_path):
    for language in ("python3", "cpp"):
        write_a_table(language, two_robots, tmp_path)  # while the robot has no place
    for name, block in BLOCKS:
        run_a_block(name, block, two_robots, tmp_path)
    for language in ("python3", "cpp"):
        for name in EXAMPLES:
            run_an_example(name, language, two_robots, chatter)


@pytest.mark.field
def test_the_examples_run_in_python_2(two_robots, chatter, tmp_path):
    write_a_table("python2.7", two_robots, tmp_path)
    for name in EXAMPLES:
        run_an_example(name, "python2.7", two_robots, chatter)
