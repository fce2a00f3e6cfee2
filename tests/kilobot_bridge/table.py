"""A table of Kilobots behind a daemon: emulated ones, or the overhead controller's double.

SWARMTALK_BUILD names the build folder. Everything that is started is ended with the test.
"""
import contextlib
import functools
import json
import os
import pathlib
import signal
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/kilobot"))
sys.path.insert(0, str(ROOT / "tests/support"))

import commands  # noqa: E402

BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()
IMAGES = BUILD / "kilobot"
EMULATOR = BUILD / "emulation/kilobot/kilobot-emulator"
DOUBLE = BUILD / "emulation/ohc_double/ohc-double"
TIMEOUT_S = 120

run = functools.partial(commands.run, timeout=TIMEOUT_S)
wait_for = functools.partial(commands.wait_for, timeout=TIMEOUT_S)

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")
needs_emulator = pytest.mark.skipif(
    not (IMAGES / "hop_count.elf").exists() or not EMULATOR.exists(),
    reason="no emulated Kilobots: gcc-avr, avr-libc or libsimavr-dev is missing")


def program(name: str) -> str:
    folder = {"swarmtalkd": "daemon", "swarmtalk-cli": "cli"}[name]
    return str(BUILD / folder / name)


class Background:
    """A process that runs beside the test, its output in files."""

    def __init__(self, folder: pathlib.Path, name: str, *command):
        self.out = folder / f"{name}.out"
        self.errors = folder / f"{name}.err"
        with self.out.open("w") as out, self.errors.open("w") as errors:
            self.process = subprocess.Popen([str(word) for word in command], stdout=out,
                                            stderr=errors, stdin=subprocess.DEVNULL)

    def is_running(self) -> bool:
        return self.process.poll() is None

    def lines(self) -> list[dict]:
        """Whole lines of standard output, as JSON."""
        return [json.loads(line) for line in self.out.read_text().split("\n")[:-1]]

    def end(self, by=signal.SIGTERM) -> int:
        if self.is_running():
            self.process.send_signal(by)
        try:
            return self.process.wait(timeout=60)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise


class Stack(contextlib.ExitStack):
    """Starts processes and ends them, the last one first."""

    def __init__(self, folder: pathlib.Path):
        super().__init__()
        self.folder = folder
        self.count = 0

    def start(self, name: str, *command) -> Background:
        self.count += 1
        process = Background(self.folder, f"{name}-{self.count}", *command)
        self.callback(process.end)
        return process


@pytest.fixture
def stack(tmp_path):
    with Stack(tmp_path) as made:
        yield made


class Wire:
    """Two network namespaces joined by a cable; names are this process's own."""

    def __init__(self, stack):
        self.names = [f"stkb{os.getpid()}{end}" for end in "ab"]
        for name in self.names:
            self.ip("netns", "add", name)
            stack.callback(self.ip, "netns", "del", name)
        self.ip("link", "add", "air0", "netns", self.names[0], "type", "veth", "peer", "name",
                "air0", "netns", self.names[1])
        for name in self.names:
            done = run("ip", "netns", "exec", name, "sysctl", "-qw",
                       "net.ipv6.conf.all.disable_ipv6=1")
            assert done.returncode == 0, done.stderr
            self.ip("-n", name, "link", "set", "air0", "up")

    @staticmethod
    def ip(*words):
        done = run("ip", *words)
        assert done.returncode == 0, done.stderr

    def prefix(self, end):
        return ("ip", "netns", "exec", self.names[end])


class Daemon:
    """A swarmtalkd with its configuration; `prefix` runs it elsewhere, in a namespace."""

    def __init__(self, stack: Stack, name: str, config: str, prefix: tuple = ()):
        self.prefix = prefix
        self.socket = stack.folder / f"{name}.sock"
        path = stack.folder / f"{name}.toml"
        path.write_text(f'[socket]\npath = "{self.socket}"\n{config}')
        self.process = stack.start(name, *prefix, program("swarmtalkd"), "--config", path)

    def wait_up(self):
        def answers():
            assert self.process.is_running(), self.process.errors.read_text()
            return self.socket.exists() and self.cli("status").returncode == 0
        wait_for(answers, what="the daemon")
        return self

    def wait_link(self, name: str):
        wait_for(lambda: self.link(name)["up"], what=f"link {name}")

    def words(self, *arguments) -> list[str]:
        return [program("swarmtalk-cli"), "--socket", str(self.socket), *map(str, arguments)]

    def cli(self, *arguments, **options):
        return run(*self.words(*arguments), **options)

    def kilobot(self, *arguments, **options):
        return self.cli("kilobot", *arguments, **options)

    def status(self) -> dict:
        done = self.cli("status", "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def link(self, name: str) -> dict:
        return next(link for link in self.status()["links"] if link["name"] == name)


def kilobot_link(downlink, uplink=None, **keys) -> str:
    """A [links.table] of type kilobot."""
    lines = ["[links.table]", 'type = "kilobot"', 'profile = "kilobot"']
    values = {"downlink": str(downlink) if downlink else None,
              "uplink": str(uplink) if uplink else None, **keys}
    lines += [f"{key} = {json.dumps(value)}" for key, value in values.items() if value is not None]
    return "\n".join(lines) + "\n"


class Double:
    """The overhead controller's double behind a terminal, with robots under it."""

    def __init__(self, stack: Stack, *options):
        self.terminal = stack.folder / "ohc"
        self.process = stack.start("double", DOUBLE, "--pty", self.terminal, "--boot-ms", 0,
                                   *options)
        wait_for(self.terminal.exists, what="the controller's terminal")

    def events(self, event: str, **fields) -> list[dict]:
        return [e for e in self.process.lines() if e["event"] == event
                and all(e.get(key) == value for key, value in fields.items())]

    def frame_types(self) -> list[int]:
        return [e["type"] for e in self.events("frame", false=False)]

    def end(self) -> dict:
        """Ends it. @return its last state"""
        self.process.end()
        return self.events("state")[-1]


def one_line(text: str, *parts: str):
    lines = text.strip().splitlines()
    assert len(lines) == 1, f"expected one line, got:\n{text}"
    for part in parts:
        assert part in lines[0], f"{part!r} is not in: {lines[0]}"
