"""A program on the robot that speaks the local protocol by hand, well or badly, and the daemon that
it speaks to. Attacks import this; each is a program of its own, so that it can be another user."""
import array
import fcntl
import itertools
import json
import os
import pathlib
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/support"))
from local_frames import field, fields, frame  # noqa: E402
from ports import udp_port  # noqa: E402

BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()
STRANGER = 65534  # nobody: a user without any right on this machine
WAIT_S = int(os.environ.get("SWARMTALK_WAIT_S", "60"))
FAILURE, SUBSCRIBE, SUBSCRIBED, ADVERTISE, ADVERTISED, GET_STATUS, STATUS = 3, 5, 6, 8, 9, 14, 15


def wait_for(condition, what, timeout=WAIT_S):
    """Polls until `condition()` is true; its value. Ends this program after `timeout` seconds."""
    deadline = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise TimeoutError(f"timed out waiting for {what}")
        time.sleep(0.01)


def open_to_everybody(folder):
    """The attacks, copied below this folder: other users may not be allowed to read the checkout.
    @return the folder that has them"""
    copy = pathlib.Path(folder) / "for-everybody"
    for part in ("tests/hostile/attacks", "tests/support"):
        shutil.copytree(ROOT / part, copy / part, dirs_exist_ok=True)
    subprocess.run(["chmod", "-R", "a+rX", copy], check=True)
    return copy / "tests/hostile/attacks"


class Client:
    """One connection. Nothing is read unless asked for."""

    def __init__(self, path, name="hostile", says_hello=True):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(WAIT_S)
        self.socket.connect(str(path))
        self.received, self.last_id, self.unread = b"", 0, []
        if says_hello:
            self.socket.sendall(frame(field(2, field(1, 1) + field(4, name))))

    def take(self):
        """The next envelope's fields. @raises EOFError at the end"""
        while True:
            if len(self.received) >= 4:
                end = 4 + struct.unpack_from("<I", self.received)[0]
                if len(self.received) >= end:
                    envelope, self.received = self.received[4:end], self.received[end:]
                    return fields(envelope)
            more = self.socket.recv(65536)
            if not more:
                raise EOFError
            self.received += more

    def post(self, body):
        """Sends a request. @return its number"""
        self.last_id += 1
        self.socket.sendall(frame(field(1, self.last_id) + body))
        return self.last_id

    def answer(self, number):
        """The answer to a request, as fields of the envelope."""
        while True:
            envelope = self.take()
            if envelope.get(1) == number:
                return envelope

    def ask(self, body):
        return self.answer(self.post(body))

    def advertise(self, channel, queue=0, copies=1, copy_interval_ms=20):
        """@return the publisher's number, or the failure's text"""
        request = field(1, field(1, channel)) + field(4, queue)
        if copies > 1:
            request += field(6, copies) + field(7, copy_interval_ms)
        reply = self.ask(field(ADVERTISE, request))
        return fields(reply[ADVERTISED])[1] if ADVERTISED in reply else failure_text(reply)

    def subscribe(self, channel, keep_last=None):
        """@return the subscription's number, or the failure's text"""
        request = field(1, field(1, channel))
        if keep_last:
            request += field(2, keep_last)
        reply = self.ask(field(SUBSCRIBE, request))
        return fields(reply[SUBSCRIBED])[1] if SUBSCRIBED in reply else failure_text(reply)

    def unread_by_daemon(self):
        """What the daemon has not taken yet, in bytes of the kernel's memory."""
        return self.count(termios.TIOCOUTQ)

    def unread_by_us(self):
        return self.count(termios.FIONREAD)

    def count(self, what):
        count = array.array("i", [0])
        fcntl.ioctl(self.socket, what, count)
        return count[0]


def failure_text(envelope):
    return fields(envelope[FAILURE]).get(2, b"").decode()


class Daemon:
    """A daemon on the UDP link over lo, whose socket everybody may use. @param configuration  more
    of it; `spawn` goes to Popen"""

    def __init__(self, configuration="", link="", folder=None, links=None, command=(),
                 **spawn):
        self.folder = pathlib.Path(folder or tempfile.mkdtemp(prefix="swarmtalk-hostile",
                                                              dir="/tmp"))
        os.chmod(self.folder, 0o755)
        self.socket, self.log = self.folder / "d.sock", self.folder / "log"
        self.config = self.folder / "d.toml"
        self.text = (f'[node]\nid = 7\n[socket]\npath = "{self.socket}"\nmode = "0666"\n'
                     + (links or '[links.w]\ntype = "udp"\ninterface = "lo"\n'
                                 f'port = {udp_port()}\n{link}') + configuration)
        self.config.write_text(self.text, encoding="utf-8")
        spawn.setdefault("stderr", open(self.log, "w", encoding="utf-8"))
        program = BUILD / "daemon/swarmtalkd"
        if "user" in spawn:  # who may not be allowed into the build folder
            program = shutil.copy(program, self.folder)
            os.chmod(program, 0o755)
        self.process = subprocess.Popen([*command, str(program), "--config", str(self.config)],
                                        **spawn)
        wait_for(lambda: self.process.poll() is not None or self.accepts(), "the daemon")
        assert self.process.poll() is None, self.log.read_text()

    def accepts(self):
        with socket.socket(socket.AF_UNIX) as probe:
            return probe.connect_ex(str(self.socket)) == 0

    def cli(self, *words):
        return subprocess.run([str(BUILD / "cli/swarmtalk-cli"), "--socket", str(self.socket),
                               *words], capture_output=True, text=True, timeout=WAIT_S,
                              stdin=subprocess.DEVNULL)

    def status(self):
        done = self.cli("status", "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def counter(self, name):
        return self.status()["counters"].get(name, 0)

    def attack(self, name, *words, uid=STRANGER, **options):
        """Starts the program NAME.py beside this file as another user."""
        script = open_to_everybody(self.folder) / f"{name}.py"
        command = [sys.executable, str(script), str(self.socket), *[str(word) for word in words]]
        if os.geteuid() == 0 and uid:
            options.update(user=uid, group=uid, extra_groups=[])
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True,
                                env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}, **options)

    def finish(self, attack):
        """Waits for an attack's end. @return what it printed, as JSON"""
        out, _ = attack.communicate(timeout=120)
        return json.loads(out) if out.strip() else None

    def memory_kib(self, which="RssAnon"):
        for line in pathlib.Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith(which + ":"):
                return int(line.split()[1])
        raise KeyError(which)

    def close(self):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(60)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        shutil.rmtree(self.folder)

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.close()


class MemoryGroup:
    """A control group with a limit of memory, of version 1 or 2; the daemon's share of it."""

    _count = itertools.count()

    def __init__(self, limit_bytes):
        root = pathlib.Path("/sys/fs/cgroup")
        is_new = (root / "cgroup.controllers").exists()
        parent = root if is_new else root / "memory"
        self.folder = parent / f"swarmtalk-test-{os.getpid()}-{next(self._count)}"
        if is_new:
            try:
                (root / "cgroup.subtree_control").write_text("+memory")
            except OSError:
                pass  # its absence shows below
        self.folder.mkdir()
        names = ("memory.max", "memory.current") if is_new else ("memory.limit_in_bytes",
                                                                 "memory.usage_in_bytes")
        self.usage = self.folder / names[1]
        try:
            (self.folder / names[0]).write_text(str(limit_bytes))
        except OSError:
            self.folder.rmdir()
            raise

    def enter(self):
        """This process, and what it starts from now on."""
        (self.folder / "cgroup.procs").write_text(str(os.getpid()))

    def used_kib(self):
        return int(self.usage.read_text()) // 1024

    def killed(self):
        """How many of its processes the kernel has ended for memory."""
        events = self.folder / ("memory.events" if self.usage.name == "memory.current"
                                else "memory.oom_control")
        counts = dict(line.split() for line in events.read_text().splitlines())
        return int(counts["oom_kill"])

    def close(self):
        """When no process is in it."""
        for _ in range(200):
            try:
                return self.folder.rmdir()
            except OSError:
                time.sleep(0.02)
