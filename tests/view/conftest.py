"""Labs of real daemons, and swarmtalk-view as a client of one of them.

SWARMTALK_BUILD names the build folder (default: build-test). Labs use the UDP medium, so no root is
needed, if the test does not say another. Everything started has ended when a test ends.
"""
import contextlib
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

import pytest

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "tests/support"))
sys.path.insert(0, str(ROOT / "client_lib/python"))

from commands import next_line, run, wait_for  # noqa: E402,F401

BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()
PROGRAMS = {"swarmtalk-view": "view", "swarmtalk-lab": "lab", "swarmtalk-cli": "cli"}
TIMEOUT_S = 60


def program(name):
    return str(BUILD / PROGRAMS[name] / name)


def one_line(text, *words):
    lines = text.strip().splitlines()
    assert len(lines) == 1, f"expected one line, got:\n{text}"
    for word in words:
        assert word in lines[0], f"{word!r} is not in: {lines[0]}"


class Lab:
    """A swarmtalk-lab that is up. Its robots are bare, if `options` have no --config."""

    def __init__(self, robots, *options, medium="udp"):
        self.name = f"v{os.getpid()}-{time.monotonic_ns() % 1000000}"
        if "--config" not in options:
            options += ("--config", ROOT / "tests/support/bare.toml")
        done = self.tool("up", robots, "--medium", medium, *options)
        assert done.returncode == 0, done.stderr
        self.state = [json.loads(line) for line in
                      self.tool("status", "--json").stdout.splitlines()]

    def tool(self, *arguments):
        return run(program("swarmtalk-lab"), "--name", self.name, *arguments)

    def socket(self, robot):
        return self.state[robot - 1]["socket"]

    def place(self, robot):
        return self.state[robot - 1]["x_m"], self.state[robot - 1]["y_m"]

    def cli(self, robot, *arguments):
        return run(program("swarmtalk-cli"), "--socket", self.socket(robot), *arguments)

    def start_cli(self, robot, *arguments):
        return subprocess.Popen([program("swarmtalk-cli"), "--socket", self.socket(robot),
                                 *[str(word) for word in arguments]], stdin=subprocess.DEVNULL,
                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def kill(self, robot):
        os.kill(self.state[robot - 1]["pid"], signal.SIGKILL)

    def down(self):
        self.tool("down")


class View:
    """A swarmtalk-view that serves."""

    def __init__(self, socket, *options):
        self.process = subprocess.Popen(
            [program("swarmtalk-view"), "--socket", str(socket), "--port", "0", *options],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline()
        assert self.address, self.process.stderr.read()
        self.port = int(self.address.split("localhost:")[1].split("/")[0])

    def cpu_seconds(self):
        """That it has used since its start, of one thread; ticks would miss what is short."""
        with open(f"/proc/{self.process.pid}/schedstat", encoding="utf-8") as file:
            return int(file.read().split()[0]) / 1e9

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def end(self, with_signal=signal.SIGTERM):
        """Exit code, and what it wrote to stderr."""
        if self.process.poll() is None:
            self.process.send_signal(with_signal)
        _, errors = self.process.communicate(timeout=TIMEOUT_S)
        return self.process.returncode, errors


@contextlib.contextmanager
def serving(lab, *options):
    """A swarmtalk-view of the lab's first robot, for a `with`."""
    view = View(lab.socket(1), *options)
    try:
        yield view
    finally:
        if view.process.poll() is None:
            view.process.kill()
            view.process.communicate()


@pytest.fixture
def make_lab():
    labs = []

    def make(robots, *options, **more):
        labs.append(Lab(robots, *options, **more))
        return labs[-1]

    yield make
    for lab in labs:
        lab.down()


@pytest.fixture
def make_view():
    views = []

    def make(socket, *options):
        views.append(View(socket, *options))
        return views[-1]

    yield make
    for view in views:
        if view.process.poll() is None:
            view.process.kill()
        view.process.communicate()
