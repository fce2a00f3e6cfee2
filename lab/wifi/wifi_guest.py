"""A Wi-Fi guest: Debian's kernel with simulated 802.11 radios (mac80211_hwsim) in QEMU, emulated,
so that no privilege of the machine and no module of its kernel is needed.

The guest sees the machine's own files at their own paths, read-only beneath a layer in its memory:
every program that is installed or built here runs in it, unmodified. `folder` is shared with it at
the same path, to be written from both sides (no sockets, though: those belong in the guest's /run).

Each radio is in a network namespace of its own, its interface called wlan0: r1 to rN the robots',
ap1 and ap2 those of access points. The namespace "" is the guest's first one, where hwsim0 shows
every frame that any radio transmits.

What is measured in here is what the kernel does. Times are those of an emulated processor.
"""
import fcntl
import json
import os
import pathlib
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import guest_image  # noqa: E402

HEADER = struct.Struct(">IcI")
PREFIX = "swarmtalk-wifi-"
START_TIMEOUT_S = 240
ACCESS_POINTS = 2


class GuestError(Exception):
    """One line: what did not work, and what the guest said."""


def missing() -> str | None:
    """Why no guest can boot on this machine; None: nothing is missing."""
    return guest_image.missing()


def sweep(base: pathlib.Path):
    """Removes what guests left behind whose keeper was killed: our folders that nobody locks."""
    for folder in base.glob(PREFIX + "*"):
        try:
            if folder.stat().st_uid != os.geteuid() or time.time() - folder.stat().st_mtime < 10:
                continue
            with open(folder / "lock", "w", encoding="ascii") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)
        except OSError:
            continue  # in use, or somebody else has just removed it


def words_of(command) -> list[str]:
    """One string is a line for the shell, several are a command and its arguments."""
    if len(command) == 1 and isinstance(command[0], str):
        return ["sh", "-c", command[0]]
    return [str(word) for word in command]


class Process:
    """A command that runs in the guest."""

    def __init__(self, control: pathlib.Path, space: str, command: list[str], env=None,
                 on_output=None):
        """@param on_output  called with (b"O" or b"R", bytes) as output comes, on another thread;
        None: it is collected in `stdout` and `stderr`"""
        self.command = command
        self.returncode = None
        self.collected = {b"O": bytearray(), b"R": bytearray()}
        self.on_output = on_output
        self.changed = threading.Condition()
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self.socket.connect(str(control))
        except OSError as error:
            raise GuestError(f"{control}: no guest there ({error.strerror})") from error
        order = {"argv": command, "space": space, "env": env or {}}
        self._send(b"S", json.dumps(order).encode())
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _send(self, kind: bytes, content: bytes = b""):
        try:
            self.socket.sendall(HEADER.pack(1, kind, len(content)) + content)
        except OSError:
            pass  # it has ended; wait() says so

    def _receive(self, size: int) -> bytes:
        content = b""
        while len(content) < size:
            piece = self.socket.recv(size - len(content))
            if not piece:
                raise ConnectionError
            content += piece
        return content

    def _read(self):
        code = -1
        try:
            while True:
                _, kind, length = HEADER.unpack(self._receive(HEADER.size))
                content = self._receive(length)
                if kind == b"X":
                    code = struct.unpack(">I", content)[0]
                    break
                if self.on_output:
                    self.on_output(kind, content)
                with self.changed:
                    if not self.on_output:
                        self.collected[kind] += content
                    self.changed.notify_all()
        except OSError:
            pass  # the guest has gone
        with self.changed:
            self.returncode = code
            self.changed.notify_all()

    @property
    def stdout(self) -> str:
        """What it wrote so far."""
        return self.collected[b"O"].decode(errors="replace")

    @property
    def stderr(self) -> str:
        return self.collected[b"R"].decode(errors="replace")

    def poll(self) -> int | None:
        """The exit code once it has ended (-1: the guest ended first), None before."""
        return self.returncode

    def write(self, text: str | bytes):
        self._send(b"I", text if isinstance(text, bytes) else text.encode())

    def close_input(self):
        self._send(b"E")

    def signal(self, number: int):
        """To the command and all that it started."""
        self._send(b"K", bytes([number]))

    def wait_for(self, condition, timeout: float, what: str):
        """Waits until condition(self), which is asked again whenever something was written.
        @return its value. @raises GuestError when it ended or the time is over before that"""
        deadline = time.monotonic() + timeout
        with self.changed:
            while True:
                value = condition(self)
                if value:
                    return value
                left = deadline - time.monotonic()
                if self.returncode is not None or left <= 0:
                    how = "it ended" if left > 0 else f"{timeout:g} s are over"
                    raise GuestError(f"{' '.join(self.command)}: waiting for {what}, but {how}: "
                                     f"{self.stdout[-500:]}{self.stderr[-1500:]}")
                self.changed.wait(min(left, 1.0))

    def wait(self, timeout: float = 60) -> int:
        """@return the exit code
        @raises GuestError when it does not end in time; it is killed then"""
        try:
            self.wait_for(lambda self: self.returncode is not None, timeout, "its end")
        except GuestError:
            self.signal(signal.SIGKILL)
            raise
        return self.returncode

    def end(self, timeout: float = 20) -> int:
        """Asks it to end, as Ctrl-C in a terminal would; kills it when it does not."""
        if self.returncode is None:
            self.signal(signal.SIGINT)
        return self.wait(timeout)

    def close(self):
        """Kills it if it runs, and lets go of it."""
        self.socket.close()


class Guest:
    """A guest that runs; close() or `with` takes it away, and so does the end of this process."""

    def __init__(self, radios: int = 3, access_points: int = ACCESS_POINTS, modules=(),
                 memory_mb: int = 768, folder: pathlib.Path | None = None, stays: bool = False):
        """@param radios  of robots; @param modules  more kernel modules, by name
        @param folder   an empty one for its files; default: one of its own
        @param stays    it runs on without this process, until end()
        @raises guest_image.Unavailable when the machine lacks something (one line)
        @raises GuestError when it does not come up"""
        self.radios, self.access_points = radios, access_points
        self.keeper = None
        reason = missing()
        if reason:
            raise guest_image.Unavailable(reason)
        base = pathlib.Path(tempfile.gettempdir())
        sweep(base)
        self.folder = folder or pathlib.Path(tempfile.mkdtemp(prefix=PREFIX, dir=base)).resolve()
        try:
            self._boot(modules, memory_mb, stays)
            self._spread_radios()
        except BaseException:
            self.close()
            raise

    @classmethod
    def attached(cls, folder) -> "Guest":
        """One that runs already, by its folder; close() leaves it alone."""
        guest = cls.__new__(cls)
        guest.radios, guest.access_points, guest.keeper = 0, 0, None
        guest.folder = pathlib.Path(folder)
        return guest

    def _boot(self, modules, memory_mb: int, stays: bool):
        with open(self.folder / "lock", "w", encoding="ascii") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            words = [sys.executable, "-B", str(HERE / "guest_keeper.py"), str(self.folder),
                     "--radios", str(self.radios + self.access_points), "--memory", str(memory_mb)]
            for name in modules:
                words += ["--module", name]
            if stays:
                words += ["--stay"]
            # The keeper holds the lock for as long as it lives.
            self.keeper = subprocess.Popen(
                words, stdin=subprocess.DEVNULL if stays else subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL if stays else None, text=True,
                pass_fds=[lock.fileno()], start_new_session=True)
        readable, _, _ = select.select([self.keeper.stdout], [], [], START_TIMEOUT_S)
        line = self.keeper.stdout.readline().strip() if readable else "no answer"
        if line != "ready":
            raise GuestError(line or "the guest's keeper ended without a word")

    def _spread_radios(self):
        """Each radio into its namespace."""
        names = self.robots + [f"ap{n}" for n in range(1, self.access_points + 1)]
        lines = ["set -e", "echo 1 > /proc/sys/net/ipv6/conf/default/disable_ipv6 || true",
                 "ip link set lo up"]
        for number, name in enumerate(names):
            lines += [f"ip netns add {name}", f"iw phy phy{number} set netns name {name}",
                      f"ip netns exec {name} sh -c 'for key in all default; do "
                      "echo 1 > /proc/sys/net/ipv6/conf/$key/disable_ipv6; done' || true",
                      f"ip -n {name} link set lo up",
                      f"ip -n {name} link set wlan{number} name wlan0"]
        self.check("", "\n".join(lines))

    @property
    def robots(self) -> list[str]:
        return [f"r{number}" for number in range(1, self.radios + 1)]

    def start(self, where: str, *command, env=None, on_output=None) -> Process:
        """Starts a command in a namespace, and returns. One string is a line for the shell."""
        return Process(self.folder / "control.sock", where, words_of(command), env, on_output)

    def run(self, where: str, *command, timeout: float = 60, env=None,
            input: str = "") -> subprocess.CompletedProcess:
        """Runs a command to its end. @return it with text output, as subprocess.run() does"""
        process = self.start(where, *command, env=env)
        try:
            if input:
                process.write(input)
            process.close_input()
            code = process.wait(timeout)
            return subprocess.CompletedProcess(process.command, code, process.stdout,
                                               process.stderr)
        finally:
            process.close()

    def check(self, where: str, *command, timeout: float = 60, **options) -> str:
        """The same for a command that has to succeed. @return what it wrote"""
        done = self.run(where, *command, timeout=timeout, **options)
        if done.returncode != 0:
            raise GuestError(f"{where or 'guest'}: {' '.join(map(str, command))}: exit code "
                             f"{done.returncode}: {done.stdout[-500:]}{done.stderr[-1500:]}")
        return done.stdout

    def put(self, name: str, content: str | bytes) -> pathlib.Path:
        """Writes a file that both sides see. @return its path, the same on both"""
        path = self.folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def console(self) -> str:
        """What the kernel wrote to its console."""
        return (self.folder / "console.log").read_text(errors="replace")

    def end(self):
        """Ends a guest that stays, also while it boots, and waits until its files are gone. Nothing
        happens if there is none."""
        deadline = time.monotonic() + 15
        while self._is_kept() and time.monotonic() < deadline:
            try:
                with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as control:
                    control.connect(str(self.folder / "control.sock"))
                    control.sendall(HEADER.pack(0, b"Q", 0))
            except OSError:
                pass  # its keeper begins or ends
            time.sleep(0.05)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _is_kept(self) -> bool:
        """Whether its keeper runs, which holds the lock from its first moment to its last."""
        try:
            with open(self.folder / "lock", encoding="ascii") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except FileNotFoundError:
            return False
        except OSError:
            return True
        return False

    def close(self):
        """Takes the guest away and waits until it is gone."""
        if self.keeper is None:
            return
        if self.keeper.stdin is None:
            self.keeper.terminate()
        else:
            self.keeper.stdin.close()
        try:
            self.keeper.wait(15)
        except subprocess.TimeoutExpired:
            self.keeper.kill()  # QEMU goes with it
            self.keeper.wait()
        self.keeper.stdout.close()
        self.keeper = None
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
