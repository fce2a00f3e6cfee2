"""Scripts in the style of Coachbots, run as they are by nine robots of a lab."""
import json
import os
import pathlib
import re
import subprocess
import time

import pytest
from conftest import BUILD, HERE, PYTHON_2, ROOT, find_python
from daemons import CLI

import daemons
import swarmtalk

RUN = ROOT / "client_lib/python/swarmtalk-run"
LAB = str(BUILD / "lab/swarmtalk-lab")
INSTALLED = ROOT / "systemd/swarmtalkd.toml"
ROBOTS = 9


class Lab:
    """Nine robots with the configuration as installed, on raw layer-2 frames where root can."""

    def __init__(self, folder, change=None):
        config = pathlib.Path(folder) / "swarmtalkd.toml"
        text = INSTALLED.read_text()
        config.write_text(change(text) if change else text)
        self.name = f"p{os.getpid()}-{time.monotonic_ns() % 1000000}"
        medium = "bridge" if os.geteuid() == 0 else "udp"
        self.tool("up", ROBOTS, "--medium", medium, "--config", config)
        self.started = []

    def tool(self, *words):
        done = subprocess.run([LAB, "--name", self.name, *map(str, words)], timeout=60, text=True,
                              capture_output=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def start(self, robot, *command):
        words = [LAB, "--name", self.name, "exec", robot, "--", *command]
        self.started.append(subprocess.Popen(
            [str(word) for word in words], text=True, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}))
        return self.started[-1]

    def run_script(self, script, python):
        """The script on all robots, to its end: [(exit code, stdout, stderr)]"""
        processes = [self.start(robot + 1, RUN, "--python", python, script)
                     for robot in range(ROBOTS)]
        return [(*process.communicate(timeout=120), process.returncode) for process in processes]

    def down(self):
        for process in self.started:
            if process.poll() is None:
                process.terminate()
                process.communicate(timeout=60)
        self.tool("down")


@pytest.fixture
def lab(tmp_path):
    labs = []

    def make(change=None):
        labs.append(Lab(tmp_path, change))
        return labs[-1]
    yield make
    for each in labs:
        each.down()


@pytest.mark.parametrize("name", ["python3", PYTHON_2])
def test_nine_robots_run_scripts_as_they_are(name, lab):
    python = find_python(name)
    robots = lab()
    for out, errors, code in robots.run_script(HERE / "coachbot/neighbours.py", python):
        assert code == 0, errors
        assert re.fullmatch(r"\d+ heard 8 robots, the nearest 0.50 m away\n", out), out + errors
    for out, errors, code in robots.run_script(HERE / "coachbot/firefly.py", python):
        assert code == 0, errors
        assert re.fullmatch(r"\d+ saw 8 blink, blinked often\n", out), out + errors
        told = errors.splitlines()
        assert len([line for line in told if "a traceback stays on this robot" in line]) == 1, told
        assert len([line for line in told if "robot.set_led() does nothing" in line]) == 1, errors
        assert len(told) == 2, errors


@pytest.mark.field
@pytest.mark.parametrize("name", ["python3", PYTHON_2])
def test_the_traceback_of_a_script_shows_on_another_robot(name, lab):
    python = find_python(name)
    robots = lab(lambda text: text.replace('id = "auto"', "id = 1")
                 .replace("[reserved]\n", "[reserved]\ndebug = true\n"))
    log = robots.start(1, CLI, "log", "--json", "-W", "100")
    while "debug" not in str(json.loads(
            robots.tool("exec", 1, "--", CLI, "status", "--json"))["channels"]):
        time.sleep(0.05)
    *others, (_, errors, code) = robots.run_script(HERE / "coachbot/leader.py", python)
    for number, (out, errors_of_other, code_of_other) in enumerate(others, 1):
        assert (out, code_of_other) == (f"{number} follows 9\n", 0), errors_of_other
    assert code == 1 and "AttributeError" in errors, errors
    assert "a traceback stays on this robot" not in errors
    log.terminate()
    lines = [json.loads(line) for line in log.communicate(timeout=60)[0].splitlines()]
    assert {line["sender"] for line in lines} == {9}
    text = [line["text"] for line in lines]
    assert text[0] == "leader.py died on robot 9:"
    assert text[1] == "Traceback (most recent call last):"
    assert 'leader.py", line 21, in usr' in text[2]
    assert "struct.unpack('if'. heard[number]" in text[3]
    assert text[-1] == "AttributeError: 'str' object has no attribute 'heard'"


@pytest.mark.field
def test_a_script_with_print_statements_runs_in_python_2(two_robots, tmp_path):
    script = tmp_path / "old.py"
    script.write_text("def usr(robot):\n    print 'robot', robot.virtual_id\n")
    done = subprocess.run([RUN, "--python", find_python("python2.7"), script], text=True,
                          capture_output=True, timeout=60,
                          env={**os.environ, "SWARMTALK_SOCKET": two_robots[0].socket})
    assert (done.returncode, done.stdout) == (0, "robot 1\n"), done.stderr


def see_what_a_script_logs(name, two_robots, tmp_path):
    script = tmp_path / "logs.py"
    script.write_text("def usr(robot):\n    robot.logger.info('hello')\n"
                      "    robot.logger.debug('detail')\n    robot.logger.warning('again')\n")
    done = subprocess.run([RUN, "--python", find_python(name), script], text=True,
                          capture_output=True, timeout=60,
                          env={**os.environ, "SWARMTALK_SOCKET": two_robots[0].socket})
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stderr.splitlines() if "stays on this robot" not in line]
    assert lines == ["INFO: hello", "WARNING: again"]


WRAPPED = """import sys
import swarmtalk
sys.excepthook = lambda *what: sys.stderr.write("own hook\\n")
robot = swarmtalk.wrap(None)
robot.fly()
"""


def run_wrapped(name, robots, tmp_path):
    """Runs a program that ends with an exception. @return what it tells"""
    program = tmp_path / "wrapped.py"
    program.write_text(WRAPPED)
    done = subprocess.run([find_python(name), program], text=True, capture_output=True,
                          timeout=60, env={**os.environ, "PYTHONPATH": daemons.CLIENT,
                                           "PYTHONDONTWRITEBYTECODE": "1",
                                           "SWARMTALK_SOCKET": robots[0].socket})
    assert done.returncode == 1
    told = done.stderr.splitlines()
    assert told[-1] == "own hook"
    return told


def see_what_ended_a_program(name, robots, tmp_path):
    """On another robot: of a robot that is wrapped, and of a script."""
    script = tmp_path / "dies.py"
    script.write_text("def usr(robot):\n    robot.heard = 'x'.heard\n")
    with swarmtalk.Client("log", robots[1].socket) as listener:
        heard = []
        listener.subscribe("debug", lambda message: heard.append(message))
        listener.sync()

        def lines_until(last):
            for _ in range(1000):  # each ends with the next message
                if heard and heard[-1].text.startswith(last):
                    break
                listener.run_once(0.05)
            assert {message.sender for message in heard} == {1}
            return [message.text for message in heard]

        assert len(run_wrapped(name, robots, tmp_path)) == 1
        lines = lines_until("AttributeError")
        assert lines[:2] == ["usr_code died on robot 1:", "Traceback (most recent call last):"]
        assert lines[-1].startswith("AttributeError: a Coachbot's robot has no 'fly'")
        heard.clear()
        done = subprocess.run([RUN, "--python", find_python(name), script], text=True,
                              capture_output=True, timeout=60,
                              env={**os.environ, "SWARMTALK_SOCKET": robots[0].socket})
        assert done.returncode == 1 and "AttributeError" in done.stderr
        assert "a traceback stays on this robot" not in done.stderr
        lines = lines_until("AttributeError")
    assert lines[:2] == ["dies.py died on robot 1:", "Traceback (most recent call last):"]
    assert 'dies.py", line 2, in usr' in lines[2] and "'x'.heard" in lines[3]
    assert lines[-1] == "AttributeError: 'str' object has no attribute 'heard'"


@pytest.mark.logic
@pytest.mark.parametrize("script, code, pattern", [
    ("nowhere.py", 2, r"cannot read nowhere.py: No such file"),
    (__file__, 3, r"cannot reach swarmtalkd: /nowhere does not exist")],
    ids=["no_such_script", "no_daemon"])
def test_a_mistake_is_one_line(script, code, pattern):
    assert mistake([script], "/nowhere", pattern) == code


def ask_for_a_python_that_is_not_there(two_robots):
    words = ["--python", "python1.5", __file__]
    assert mistake(words, two_robots[0].socket, r"python1.5 cannot be started") == 2


def mistake(words, socket, pattern):
    """The exit status; what is told is one line that has the pattern."""
    done = subprocess.run([RUN, *words], text=True, capture_output=True, timeout=60,
                          env={**os.environ, "SWARMTALK_SOCKET": socket})
    lines = [line for line in done.stderr.splitlines() if "stays on this robot" not in line]
    assert len(lines) == 1 and re.search(pattern, lines[0]), done.stderr
    return done.returncode


def run_a_script_without_usr(two_robots, tmp_path):
    script = tmp_path / "empty.py"
    script.write_text("def user(robot):\n    pass\n")
    done = subprocess.run([RUN, script], text=True, capture_output=True, timeout=60,
                          env={**os.environ, "SWARMTALK_SOCKET": two_robots[0].socket})
    assert done.returncode == 1
    assert "empty.py has no function usr(robot)" in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr


WRONG = [
    ("def usr(robot)\n    pass\n", "SyntaxError"), ("def usr(robot):\npass\n", "IndentationError"),
    ("import nothing_of_this_name\n", "ModuleNotFoundError"),
    ("def usr(robot):\n    return 1 / 0\n", "ZeroDivisionError"),
    ("def usr(robot):\n    open('/nowhere/file')\n", "FileNotFoundError")]


def see_a_traceback_begin_in_the_script(text, last, two_robots, tmp_path):
    script = tmp_path / "wrong.py"
    script.write_text(text)
    done = subprocess.run([RUN, script], text=True, capture_output=True, timeout=60,
                          env={**os.environ, "SWARMTALK_SOCKET": two_robots[0].socket})
    assert done.returncode == 1, last
    assert done.stderr.splitlines()[-1].startswith(last), done.stderr
    assert f'File "{script}", line' in done.stderr
    assert "swarmtalk.py" not in done.stderr and "swarmtalk-run" not in done.stderr


@pytest.mark.parametrize("name", ["python3", PYTHON_2])
def test_what_a_script_logs_and_dies_of_is_seen(name, tmp_path):
    with daemons.Daemons(2) as robots:
        see_what_a_script_logs(name, robots, tmp_path)
        told = run_wrapped(name, robots, tmp_path)
        assert len(told) == 2 and "set debug = true under [reserved]" in told[0], told
        ask_for_a_python_that_is_not_there(robots)
        run_a_script_without_usr(robots, tmp_path)
        for text, last in WRONG:
            see_a_traceback_begin_in_the_script(text, last, robots, tmp_path)
    with daemons.Daemons(2, "[reserved]\ndebug = true\n") as robots:
        see_what_ended_a_program(name, robots, tmp_path)


@pytest.mark.logic
@pytest.mark.parametrize("words, told", [
    ([], "the following arguments are required: script"),
    (["--within", "far", "x.py"], "argument --within: invalid float value: 'far'"),
    (["x.py", "y.py"], "'y.py' is one word too many"),
    (["--zzz", "x.py"], "there is no option '--zzz'"),
    (["--chanel", "x", "f.py"], "there is no option '--chanel'; did you mean '--channel'?")])
def test_a_wrong_command_line_is_told_in_one_line(words, told):
    done = subprocess.run([RUN, *words], text=True, capture_output=True, timeout=60)
    assert done.returncode == 2
    see = " See" if told.endswith("?") else "; see"
    assert done.stderr == f"swarmtalk-run: {told}{see} swarmtalk-run --help\n"
