"""Real daemons for tests of the Python client; runs on Python 2.7 and 3.

SWARMTALK_BUILD names the build folder. The daemons of one Daemons hear each other over the UDP link
on a port of their own; poses are told by the tests.
"""
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.append(os.path.join(ROOT, "tests", "support"))
from ports import udp_port  # noqa: E402

BUILD = os.path.abspath(os.environ.get("SWARMTALK_BUILD") or os.path.join(ROOT, "build-test"))
CLIENT = os.path.join(ROOT, "client_lib", "python")
DAEMON = os.path.join(BUILD, "daemon", "swarmtalkd")
CLI = os.path.join(BUILD, "cli", "swarmtalk-cli")
START_S = 60


class Daemon(object):
    """One robot's daemon, which can be killed and started again."""

    def __init__(self, folder, number, port, configuration):
        self.number = number
        self.socket = os.path.join(folder, "%d.sock" % number)
        self.config = os.path.join(folder, "%d.toml" % number)
        with open(self.config, "w") as file:
            file.write('[node]\nid = %d\n[socket]\npath = "%s"\n' % (number, self.socket))
            file.write('[links.test]\ntype = "udp"\ninterface = "lo"\nport = %d\n' % port)
            file.write(configuration)
        self.log = open(os.path.join(folder, "%d.log" % number), "w")
        self.process = None

    def start(self):
        self.process = subprocess.Popen([DAEMON, "--config", self.config], stderr=self.log)
        deadline = time.time() + START_S
        while not self.accepts():
            assert self.process.poll() is None, open(self.log.name).read()
            assert time.time() < deadline, "the daemon does not start"
            time.sleep(0.01)

    def accepts(self):
        probe = socket.socket(socket.AF_UNIX)
        try:
            probe.connect(self.socket)
            return True
        except (OSError, IOError):
            return False
        finally:
            probe.close()

    def kill(self):
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process = None


class Daemons(object):
    """So many robots. Everything started has ended when it is closed."""

    def __init__(self, count=2, configuration=""):
        self.folder = tempfile.mkdtemp(prefix="swarmtalk-py")
        port = udp_port()
        self.robots = [Daemon(self.folder, number + 1, port, configuration)
                       for number in range(count)]
        try:
            for robot in self.robots:
                robot.start()
        except BaseException:
            self.close()
            raise

    def __getitem__(self, index):
        return self.robots[index]

    def close(self):
        for robot in self.robots:
            robot.kill()
            robot.log.close()
        shutil.rmtree(self.folder)

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.close()
