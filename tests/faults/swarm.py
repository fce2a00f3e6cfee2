"""Daemons and steady traffic on a wire, for the fault suite: what to start, and its accounts."""
import json
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))

import wire  # noqa: E402

BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()
TRAFFIC = BUILD / "tests/faults/traffic"
SWARMTALKD = BUILD / "daemon/swarmtalkd"
START_S = 60


class Traffic:
    """A running traffic program: its lines, as they come."""

    def __init__(self, robot, role, *arguments):
        self.robot = robot
        self.role = role
        self.arguments = arguments
        self.process = robot.start(TRAFFIC, role, *arguments, text=True, stdout=subprocess.PIPE,
                                   stderr=robot.log,
                                   env={**os.environ, "SWARMTALK_SOCKET": str(robot.socket)})
        self.lines = []
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line.split())

    def times_ns(self, word):
        return [int(line[1]) for line in self.lines if line[0] == word]

    def wait_ready(self):
        wait_for(lambda: ["ready"] in self.lines or self.process.poll() is not None, START_S,
                 f"{self.arguments} to get ready")
        assert ["ready"] in self.lines, self.robot.log_text()
        return self

    def end(self):
        """Asks it to end. @return its account"""
        self.process.send_signal(signal.SIGCONT)
        self.process.terminate()
        assert self.process.wait(START_S) == 0, self.robot.log_text()
        self.reader.join(START_S)
        return json.loads(" ".join(self.lines[-1]))

    def kill(self):
        self.process.kill()
        self.process.wait(START_S)
        self.reader.join(START_S)


class Robot:
    """One namespace with its daemon."""

    def __init__(self, robots, index, folder, limits=""):
        self.robots = robots
        self.name = robots.names[index]
        self.socket = folder / f"{index + 1}.sock"
        self.config = folder / f"{index + 1}.toml"
        self.config.write_text(
            f'[node]\nid = {index + 1}\n[socket]\npath = "{self.socket}"\n'
            f'[links.wire]\ntype = "raw_l2"\ninterface = "wlan0"\n{limits}')
        self.log_path = folder / f"{index + 1}.log"
        self.log = open(self.log_path, "a", encoding="utf-8")
        self.daemon = None

    def start(self, *command, **options):
        return self.robots.start(self.name, *command, **options)

    def start_daemon(self):
        """@return CLOCK_MONOTONIC in ns when it accepts clients"""
        import socket
        self.daemon = self.start(SWARMTALKD, "--config", self.config, stdout=self.log,
                                 stderr=self.log)

        def accepts():
            assert self.daemon.poll() is None, self.log_text()
            with socket.socket(socket.AF_UNIX) as client:
                return client.connect_ex(str(self.socket)) == 0
        wait_for(accepts, START_S, "the daemon")
        return time.monotonic_ns()

    def kill_daemon(self):
        self.daemon.kill()
        self.daemon.wait(START_S)

    def stop_daemon(self):
        self.daemon.terminate()
        assert self.daemon.wait(START_S) == 0, self.log_text()

    def log_text(self):
        return self.log_path.read_text()[-4000:]

    def descriptors(self):
        return len(list(pathlib.Path(f"/proc/{self.daemon.pid}/fd").iterdir()))

    def memory_kb(self):
        """Resident memory of the daemon, in KiB."""
        status = pathlib.Path(f"/proc/{self.daemon.pid}/status").read_text()
        return next(int(line.split()[1]) for line in status.splitlines()
                    if line.startswith("VmRSS"))


class Swarm:
    """Robots on a wire, with daemons. Everything it started has ended when it exits."""

    def __init__(self, count, folder, limits=""):
        self.wire = wire.Robots(count, "stf")
        self.folder = folder
        self.count = count
        self.limits = limits
        self.robots = []
        self.traffic = []

    def __enter__(self):
        self.wire.__enter__()
        try:
            self.robots = [Robot(self.wire, index, self.folder, self.limits)
                           for index in range(self.count)]
            for robot in self.robots:
                robot.start_daemon()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        processes = [traffic.process for traffic in self.traffic]
        processes += [robot.daemon for robot in self.robots if robot.daemon is not None]
        for process in processes:
            if process.poll() is None:
                process.kill()
                process.wait(START_S)
        self.wire.__exit__()

    def send(self, robot, name, channel, rate_hz, size_bytes=64):
        return self._add(robot, "send", name, channel, rate_hz, size_bytes)

    def hear(self, robot, name, channel):
        return self._add(robot, "hear", name, channel)

    def _add(self, robot, role, *arguments):
        traffic = Traffic(self.robots[robot], role, *arguments)
        self.traffic.append(traffic)
        return traffic.wait_ready()


def wait_for(condition, timeout_s, what):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, f"timed out waiting for {what}"
        time.sleep(0.005)
