"""Fixtures for tests with real daemons on real wires.

SWARMTALK_BUILD names the build folder (default: build-test). Each lab gets a name of its own and is
taken down whatever happens. Tests that need root are skipped, with that reason, without it.
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))

from commands import next_line, run, wait_for  # noqa: E402,F401
from ports import udp_port  # noqa: E402,F401

BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")


def pytest_collection_modifyitems(items):
    for item in items:
        if {"bridge_lab", "radio_lab"} & set(getattr(item, "fixturenames", ())):
            item.add_marker(needs_root)


def program(name):
    """Path of one of our programs in the build folder."""
    places = {"swarmtalkd": "daemon", "swarmtalk-cli": "cli", "swarmtalk-lab": "lab",
              "swarmtalk-view": "view"}
    return str(BUILD / places.get(name, "tests/integration") / name)


class Lab:
    """A swarmtalk-lab that is up. Its robots are bare, if `options` have no --config."""

    def __init__(self, robots, medium, *options, as_installed=False):
        self.name = f"t{os.getpid()}-{time.monotonic_ns() % 1000000}"
        if "--config" not in options and not as_installed:
            options += ("--config", ROOT / "tests/support/bare.toml")
        done = self.tool("up", robots, "--medium", medium, *options)
        assert done.returncode == 0, done.stderr
        self.robots = robots

    def tool(self, *arguments, **options):
        return run(program("swarmtalk-lab"), "--name", self.name, *arguments, **options)

    def execute(self, robot, *command, **options):
        return self.tool("exec", robot, "--", *command, **options)

    def cli(self, robot, *arguments, **options):
        return self.execute(robot, program("swarmtalk-cli"), *arguments, **options)

    def start(self, robot, *command, **options):
        """Starts a command as a robot; returns the running process."""
        words = [program("swarmtalk-lab"), "--name", self.name, "exec", robot, "--", *command]
        options = {"stdin": subprocess.DEVNULL, **options}
        return subprocess.Popen([str(word) for word in words], text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)

    def start_sub(self, robot, *arguments):
        """Starts `swarmtalk-cli sub`; returns it once it is subscribed."""
        before = self.subscriptions(robot)
        process = self.start(robot, program("swarmtalk-cli"), "sub", *arguments)
        wait_for(lambda: self.subscriptions(robot) > before or process.poll() is not None,
                 what="subscription")
        return process

    def subscriptions(self, robot):
        return sum(channel["subscribers"] for channel in self.status(robot)["channels"])

    def status(self, robot):
        """The daemon's status as JSON."""
        done = self.cli(robot, "status", "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def link_counter(self, robot, name):
        return self.status(robot)["links"][0]["counters"].get(name, 0)

    def namespace(self, robot):
        return f"swarmtalk-{self.name}-{robot}"

    def folder(self):
        return pathlib.Path(self.state()[0]["socket"]).parent

    def state(self):
        done = self.tool("status", "--json")
        return [json.loads(line) for line in done.stdout.splitlines()]

    def pid(self, robot):
        return self.state()[robot - 1]["pid"]

    def medium(self):
        """What the medium says of itself."""
        done = self.tool("medium", "status", "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def down(self):
        return self.tool("down")


@pytest.fixture
def bridge_lab():
    """Makes labs on raw layer-2 frames: bridge_lab(robots, options...)."""
    yield from _labs("bridge")


@pytest.fixture
def radio_lab():
    """Makes labs whose robots share a simulated Wi-Fi channel: radio_lab(robots, options...)."""
    yield from _labs("radio")


@pytest.fixture
def radio_udp_lab():
    """The same over the daemons' UDP links, which need no privilege."""
    yield from _labs("radio-udp")


@pytest.fixture
def udp_lab():
    """Makes labs over the UDP link, which need no privilege."""
    yield from _labs("udp")


def _labs(medium):
    labs = []

    def make(robots, *options, **more):
        labs.append(Lab(robots, medium, *options, **more))
        return labs[-1]

    yield make
    for lab in labs:
        lab.down()


@pytest.fixture
def talking_lab(udp_lab):
    """Three robots; robot 1 publishes on `alarm` and robot 2 on 4711, and robot 3 hears `alarm`."""
    made = udp_lab(3)
    cli = program("swarmtalk-cli")
    started = [made.start(1, cli, "pub", "alarm", "hello", "--repeat", "0", "--rate", "20"),
               made.start(2, cli, "pub", "4711", "--fmt", "<Hf", "7 2.5", "--repeat", "0",
                          "--rate", "20")]
    started.append(made.start_sub(3, "alarm"))
    started.append(made.start(1, cli, "ping", "--answer"))
    wait_for(lambda: any(each["name"] == "ping" and each["subscribers"]
                         for each in made.status(1)["channels"]), what="the answering robot")
    yield made
    for process in started:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)


def one_line(text, *patterns):
    """Asserts that `text` is one line and that each pattern is found in it."""
    lines = text.strip().splitlines()
    assert len(lines) == 1, f"expected one line, got:\n{text}"
    for pattern in patterns:
        assert re.search(pattern, lines[0]), f"{pattern!r} is not in: {lines[0]}"
