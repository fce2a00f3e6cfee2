"""Daemons of this build on simulated 802.11 radios, in a virtual machine with Debian's kernel.

    import guest

    guest.needs_guest()                       # skips the test where none can boot, with the reason
    with guest.Guest(radios=3) as machine:    # 12 s of a core; share one between many tests
        with machine.network("ibss"):         # or "mesh", "ap", "ap-isolated"
            one = machine.daemon("r1")
            machine.daemon("r2")
            machine.run("r1", "iw", "dev", "wlan0", "info").stdout      # one argument: a shell line
            machine.cli("r1", "status", "--json").stdout
            accounts = machine.exchange("r1", ["r2"], messages=50)

Radios are in network namespaces r1 to rN (robots) and ap1, ap2 (access points), each interface is
called wlan0, all of it as root; "" is the guest's first namespace, where hwsim0 (`ip link set
hwsim0 up`) shows every frame on the air.

What there is, all of it bounded in time (errors: guest.GuestError, one line):
  run(where, *command, timeout=60, env=None, input="")   -> subprocess.CompletedProcess, text
  check(where, *command)        -> what it wrote; an exit code other than 0 is an error
  start(where, *command)        -> Process: stdout, stderr so far, poll(), write(text),
                                   close_input(), wait(timeout), signal(number),
                                   wait_for(condition, timeout, what), end() (SIGINT and wait),
                                   close() (kill)
  folder, put(name, content)    -> files: this folder has the same path in the guest and out here;
                                   no sockets in it, those belong in the guest's /run
  network(mode, robots=None, channel=1, mcast_rate="6", basic_rates="60 120 240", hostapd={...})
                                -> Network: programs, stop_access_point(), start_access_point(),
                                   start_supplicant(robot), wait_until_joined(robots), down()
  medium(places={"r2": (30, 0)}) -> Medium: our air instead of the kernel's, losing by distance and
                                   rate; place(), power(), lose(sender, receiver, share), counters()
  daemon(robot, link="", more="", pose=(x, y)) -> Daemon: process, socket, config, end()
  cli(robot, *arguments)        -> CompletedProcess of swarmtalk-cli as that robot
  stats(robot)                  -> what `swarmtalk-cli stats --json` says, as a dictionary
  Capture(machine, where, interface)  -> with it: frames(condition of tcpdump), one line each
  exchange(sender, listeners, messages, rate_hz, size) -> robot -> Account
  exchanges({sender: listeners}, ...) -> (sender, listener) -> Account, all at once
  modules=(...) of Guest()      -> more kernel modules: "bridge", "nf_tables", "batman_adv"

Every program of this machine and of this build runs in the guest, at its own path. To use another
build: SWARMTALK_BUILD. What is written elsewhere than in `folder` stays in the guest's memory.
"""
import dataclasses
import json
import os
import pathlib
import shutil
import sys
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()
sys.path.insert(0, str(ROOT / "lab/wifi"))

import wifi_guest  # noqa: E402
from guest_image import Unavailable  # noqa: E402,F401
from wifi_guest import GuestError, Process  # noqa: E402,F401
from wifi_medium import Medium  # noqa: E402
from wifi_network import Network  # noqa: E402

TALKER = pathlib.Path(__file__).resolve().parent / "talker.py"
BEACON_MS = 500
SETTLE_S = 12
START_S = 120  # an emulated processor beside other tests takes its time
WARM_UP_TRIES = 8


def program(name: str) -> str:
    """A program of the build."""
    folder = {"swarmtalkd": "daemon", "swarmtalk-cli": "cli", "swarmtalk-lab": "lab",
              "swarmtalk-wifi-medium": "lab/wifi/medium"}[name]
    return str(BUILD / folder / name)


def needs_guest():
    """Skips what asks when no guest can boot here, or nothing is built that could run in it."""
    reason = wifi_guest.missing()
    if reason:
        pytest.skip(f"{reason}; tools/setup more installs all that a Wi-Fi guest needs")
    for name in ("swarmtalkd", "swarmtalk-cli"):
        if not os.path.exists(program(name)):
            pytest.skip(f"{program(name)} is not built")


def needs_program(name: str):
    if shutil.which(name) is None:
        pytest.skip(f"{name} is not installed (tools/setup more)")


@dataclasses.dataclass
class Account:
    """Where the messages are that one robot sent another one on a channel."""
    sent: int
    heard: int = 0
    lost_air: int = 0
    lost_kernel: int = 0
    lost_daemon: int = 0
    lost_client: int = 0
    late: int = 0
    first: int = 1  # number of the first that was heard; losses are known from there on
    duplicates: int = 0

    @property
    def unheard_of(self) -> int:
        """Sent before the first that was heard, or all: no daemon can know of them."""
        return self.first - 1 if self.heard else self.sent

    @property
    def unaccounted(self) -> int:
        """What is neither heard nor lost somewhere; 0, or something is wrong (negative: counted
        twice). Of those before the first that was heard, beacons may have told some."""
        lost = self.lost_air + self.lost_kernel + self.lost_daemon + self.lost_client - self.late
        missing = self.sent - self.heard - lost
        return missing if missing < 0 else max(0, missing - self.unheard_of)


class Daemon:
    def __init__(self, machine: "Guest", robot: str, config: str):
        self.machine, self.robot = machine, robot
        self.socket = f"/run/{robot}.sock"
        self.config = machine.put(f"{robot}.toml", config)
        self.process = machine.start(robot, program("swarmtalkd"), "--config", str(self.config))
        try:
            self.process.wait_for(lambda process: " serves " in process.stdout + process.stderr,
                                  START_S, "swarmtalkd to serve")
        except wifi_guest.GuestError:
            self.process.close()
            raise

    @property
    def log(self) -> str:
        return self.process.stdout + self.process.stderr

    def end(self):
        code = self.process.end()
        self.process.close()
        self.machine.daemons.pop(self.robot, None)
        return code


class Guest(wifi_guest.Guest):
    """See above, and lab/wifi/wifi_guest.py."""

    def __init__(self, radios: int = 3, **options):
        self.daemons: dict[str, Daemon] = {}
        self.talker, self.told = None, 0
        super().__init__(radios, **options)

    def network(self, mode: str, **options) -> Network:
        return Network(self, mode, **options)

    def medium(self, places=None, seed: int = 1) -> Medium:
        path = program("swarmtalk-wifi-medium")
        if not os.path.exists(path):
            pytest.skip("swarmtalk-wifi-medium is not built: no libnl-genl-3-dev "
                        "(tools/setup run)")
        return Medium(self, path, places, seed)

    def daemon(self, robot: str, link: str = "", more: str = "", pose=None) -> Daemon:
        """Starts swarmtalkd as `robot` and waits until it serves.
        @param link  more lines of [links.wifi], TOML; @param more  more sections
        @param pose  metres; default: one metre beside the robot before"""
        number = int(robot[1:])
        x, y = pose or (float(number), 0.0)
        text = (f"[node]\nid = {number}\npose = [{float(x)}, {float(y)}, 0.0]\n"
                f"[socket]\npath = \"/run/{robot}.sock\"\n"
                f"[links.wifi]\ntype = \"raw_l2\"\ninterface = \"wlan0\"\n")
        if "beacon_ms" not in link:
            text += f"beacon_ms = {BEACON_MS}\n"
        self.daemons[robot] = Daemon(self, robot, f"{text}{link}\n{more}\n")
        return self.daemons[robot]

    def end_daemons(self):
        for daemon in list(self.daemons.values()):
            daemon.end()

    def cli(self, robot: str, *arguments, **options):
        return self.run(robot, *self._cli(robot, *arguments), **options)

    @staticmethod
    def _cli(robot: str, *arguments) -> list[str]:
        return [program("swarmtalk-cli"), "--socket", f"/run/{robot}.sock", *map(str, arguments)]

    def stats(self, robot: str) -> dict:
        done = self.cli(robot, "stats", "--json")
        if done.returncode != 0:
            raise GuestError(f"{robot}: swarmtalk-cli stats: {done.stderr}")
        return json.loads(done.stdout)

    def exchange(self, sender: str, listeners: list[str], messages: int = 50,
                 rate_hz: float = 25, size: int = 16, channel: str = "count",
                 expected: bool = True) -> dict[str, Account]:
        """Sends messages from one robot to others and accounts for each of them.
        @param expected  whether the listeners should hear anything: it is sent on until each has
        heard a first message, since a loss is known only from there on"""
        accounts = self.exchanges({sender: listeners}, messages, rate_hz, size, channel, expected)
        return {robot: account for (_, robot), account in accounts.items()}

    def exchanges(self, ways: dict[str, list[str]], messages: int = 50, rate_hz: float = 25,
                  size: int = 16, channel: str = "count", expected: bool = True):
        """The same of several senders at once, each listener being one's alone.
        @return {(sender, listener): Account}"""
        path = "/run/{}.sock".format
        answer = self._talk({
            "ways": [[path(sender), [path(robot) for robot in listeners]]
                     for sender, listeners in ways.items()],
            "channel": channel, "messages": messages, "rate_hz": rate_hz, "size": size,
            "tries": WARM_UP_TRIES if expected else 1, "settle_s": SETTLE_S if expected else 2})
        robots = {path(robot): robot for robot in self.robots}
        return {(robots[sender], robots[robot]): Account(**account)
                for sender, robot, account in answer["accounts"]}

    def _talk(self, order: dict) -> dict:
        """An order to the talker, which is started with the first one. @return its answer"""
        def next_line(process):
            return process.stdout.split("\n")[self.told:-1]

        if self.talker is None or self.talker.poll() is not None:
            self.talker, self.told = self.start("", sys.executable, "-B", str(TALKER)), 0
            self.talker.wait_for(next_line, 60, "the talker")
            self.told = 1
        self.talker.write(json.dumps(order) + "\n")
        limit = 120 + 3 * order["messages"] / order["rate_hz"]
        answer = json.loads(self.talker.wait_for(next_line, limit, "an exchange")[0])
        self.told += 1
        if "error" in answer:
            raise GuestError(f"the talker: {answer['error']}")
        return answer


class Capture:
    """Frames that one interface of the guest sees while this is open."""

    def __init__(self, machine, where, interface):
        needs_program("tcpdump")
        self.machine = machine
        self.file = f"/run/capture-{time.monotonic_ns()}.pcap"
        self.process = machine.start(where, "tcpdump", "-U", "-i", interface, "-w", self.file)
        self.process.wait_for(lambda process: "listening on" in process.stderr, 60, "tcpdump")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.end()
        self.process.close()

    def frames(self, condition):
        """One line of tcpdump for each frame that fits: radiotap, then 802.11."""
        lines = self.machine.check("", "tcpdump", "-n", "-e", "-r", self.file, condition)
        return [line for line in lines.splitlines() if not line.startswith("\t")]  # no hexadecimal
