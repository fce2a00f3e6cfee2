"""Robots in network namespaces, each on one or several wires, with configurations of their own.

A wire is a bridge in a namespace; a robot has the interface `NAME0` for the wire NAME. All names
are this process's own, and everything is removed whatever happens.
"""
import itertools
import json
import os
import pathlib
import subprocess
import sys
import tempfile

from commands import next_line, run, wait_for
from conftest import program

LOSSY = str(pathlib.Path(__file__).resolve().parents[1] / "support/lossy_wire.py")

_count = itertools.count()


def _ip(*words):
    done = run("ip", *words)
    assert done.returncode == 0, f"ip {' '.join(map(str, words))}: {done.stderr}"


class Wires:
    """A set of wires and of robots on them; a context manager."""

    def __init__(self):
        self._prefix = f"sw{os.getpid()}x{next(_count)}"
        self._namespaces = []
        self._processes = []
        self._folder = tempfile.TemporaryDirectory(prefix="swarmtalk-wires-")
        self._robots = 0
        self._ports = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in self._processes:
            if process.poll() is None:
                process.kill()
            process.communicate(timeout=60)
        for name in self._namespaces:
            run("ip", "netns", "del", name)
        self._folder.cleanup()

    def end_all(self):
        """Ends what runs in the robots: programs, then daemons. The robots and wires stay."""
        for process in reversed(self._processes):
            if process.poll() is None:
                process.terminate()
                process.communicate(timeout=60)

    def _namespace(self, name):
        full = f"{self._prefix}{name}"
        _ip("netns", "add", full)
        self._namespaces.append(full)
        run("ip", "netns", "exec", full, "sysctl", "-qw", "net.ipv6.conf.all.disable_ipv6=1",
            "net.ipv6.conf.default.disable_ipv6=1")
        return full

    def wire(self, name):
        """A new wire; robots join it by this name."""
        full = self._namespace(name)
        _ip("-n", full, "link", "add", "name", "hub0", "type", "bridge", "mcast_snooping", "0")
        _ip("-n", full, "link", "set", "hub0", "up")
        return name

    def robot(self, *wires):
        """A robot with an interface `WIRE0` for each wire."""
        self._robots += 1
        robot = Robot(self, self._robots, self._namespace(f"r{self._robots}"))
        for wire in wires:
            self.plug(robot, wire)
        return robot

    def plug(self, robot, wire):
        """Joins a robot to a wire."""
        full = f"{self._prefix}{wire}"
        self._ports += 1
        port = f"p{self._ports}"
        _ip("-n", full, "link", "add", port, "type", "veth", "peer", "name", f"{wire}0", "netns",
            robot.namespace)
        _ip("-n", full, "link", "set", port, "master", "hub0")
        _ip("-n", full, "link", "set", port, "up")
        _ip("-n", robot.namespace, "link", "set", f"{wire}0", "up")
        robot.ports[wire] = port
        self.wait_for_wire(robot, wire)

    def wait_for_wire(self, robot, wire):
        """Until the robot, whose interface has come up, hears what others send on the wire: the
        bridge notices some time after the robot does."""
        port, full = robot.ports[wire], f"{self._prefix}{wire}"

        def forwards():
            return " state forwarding " in run("bridge", "-n", full, "link", "show", "dev",
                                               port).stdout

        wait_for(forwards, what=f"the bridge's port of wire {wire}")

    def lose(self, wire, share, seed=1):
        """From now on each frame on this wire is lost at each receiver by itself, so often."""
        full = f"{self._prefix}{wire}"
        links = json.loads(run("ip", "-n", full, "-j", "link", "show", "type", "veth").stdout)
        ports = [link["ifname"] for link in links]
        for port in ports:
            _ip("-n", full, "link", "set", port, "nomaster")
        relay = self.keep(subprocess.Popen(
            ["ip", "netns", "exec", full, sys.executable, LOSSY, str(share), str(seed), *ports],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        assert next_line(relay) == "ready"

    def file(self, name):
        """Path of a file that goes with the wires."""
        return os.path.join(self._folder.name, name)

    def keep(self, process):
        """Ends the process with the wires."""
        self._processes.append(process)
        return process


class Robot:
    """A namespace with one daemon and its programs."""

    def __init__(self, wires, number, namespace):
        self.number = number
        self.namespace = namespace
        self.socket = wires.file(f"{number}.sock")
        self._wires = wires
        self._config = wires.file(f"{number}.toml")
        self.log = wires.file(f"{number}.log")
        self.daemon = None
        self.ports = {}  # of the bridges, by wire

    def configure(self, config):
        """Writes the daemon's file; one that runs reads it when it is told to reload."""
        with open(self._config, "w", encoding="utf-8") as file:
            file.write(config)

    def start(self, config, wait=True, command=None):
        """Starts swarmtalkd (or `command`, words before its options) with this TOML; waits until it
        serves and its links are up."""
        self.configure(config)
        log = open(self.log, "a", encoding="utf-8")
        self.daemon = self._wires.keep(subprocess.Popen(
            self._words(*(command or [program("swarmtalkd")]), "--config", self._config, "--socket",
                        self.socket),
            stdin=subprocess.DEVNULL, stdout=log, stderr=log))
        log.close()
        if wait:
            wait_for(lambda: self.daemon.poll() is not None or self.cli("status").returncode == 0,
                     what="the daemon to serve")
            assert self.daemon.poll() is None, self.logged()
            # The kernel may take a second to tell of a new interface's carrier.
            wait_for(lambda: all(link["up"] for link in self.status()["links"]), what="the links")
        return self

    def stop(self):
        """Ends the daemon."""
        self.daemon.terminate()
        self.daemon.wait(timeout=60)

    def logged(self):
        with open(self.log, encoding="utf-8") as file:
            return file.read()

    def _words(self, *command):
        return ["ip", "netns", "exec", self.namespace, *map(str, command)]

    def execute(self, *command, **options):
        return run(*self._words(*command), **options)

    def cli(self, *arguments, **options):
        return self.execute(program("swarmtalk-cli"), "--socket", self.socket, *arguments,
                            **options)

    def status(self):
        done = self.cli("status", "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def counter(self, name):
        return self.status()["counters"][name]

    def link(self, name):
        return next(link for link in self.status()["links"] if link["name"] == name)

    def subscribe(self, *arguments):
        """Starts `swarmtalk-cli sub --json`; returns it once it is subscribed."""
        return self.listen("sub", "--json", *arguments)

    def listen(self, *arguments, file=False):
        """Starts a subcommand of swarmtalk-cli that subscribes; returns it once it has.

        With `file`, what it prints goes to a file, for written(): a pipe holds few messages.
        """
        def subscribers():
            return sum(channel["subscribers"] for channel in self.status()["channels"])

        before = subscribers()
        words = self._words(program("swarmtalk-cli"), "--socket", self.socket, *arguments)
        out = tempfile.TemporaryFile("w+", encoding="utf-8") if file else subprocess.PIPE
        process = self._wires.keep(subprocess.Popen(
            words, text=True, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.PIPE))
        process.file = out if file else None
        wait_for(lambda: subscribers() > before or process.poll() is not None, what="subscription")
        return process

    def begin(self, *arguments):
        """Starts a subcommand of swarmtalk-cli."""
        words = self._words(program("swarmtalk-cli"), "--socket", self.socket, *arguments)
        return self._wires.keep(subprocess.Popen(
            words, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE))

    def publish(self, channel, text, *arguments):
        done = self.cli("pub", channel, text, *arguments)
        assert done.returncode == 0, done.stderr


def heard(process, timeout=90):
    """What a subscriber printed until its end."""
    out, _ = process.communicate(timeout=timeout)
    return [json.loads(line) for line in out.splitlines()]


def written(process):
    """What a subscriber has written to its file."""
    process.file.seek(0)
    return [json.loads(line) for line in process.file]
