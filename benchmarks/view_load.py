#!/usr/bin/python3
"""What the live map costs: a hundred robots on one viewer, a browser that stops reading, the air.

usage: benchmarks/view_load.py [--build build-test] [--robots 100] [--seconds 20] [--pairs 7]

Everything runs in a network namespace of its own (root). First one daemon hears frames of --robots
robots that move, each 10 a second with a pose and a message of 20 bytes, as they would be on the
air. Prints the share of a core that swarmtalk-view takes without and with one viewer; and, in
interleaved pairs of runs, what one viewer gets (states a second, the longest gap between two of
them, age of messages) while another has stopped reading or not. Then a lab of real daemons that
report, without, with one and with three viewers on different robots: the share of the air that
reports take at any robot, at 6 Mb/s, beside the budget of 1 %. CPU is schedstat of
all threads.
"""
import argparse
import json
import math
import os
import pathlib
import platform
import signal
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/view"))
from websocket import WebSocket  # noqa: E402

GROUP, PORT = "239.255.83.84", 21332
RATE_HZ = 10
PAGE = "swarmtalk.view.v1"
INSIDE = "SWARMTALK_VIEW_LOAD_INSIDE"  # set in the namespace
AIR_US = 127  # as docs/wire-format.md takes the air of a report: this, and 80 bytes around it
AROUND_BYTES = 80
CONFIG = """[node]
id = 500
pose = [0.0, 0.0, 0.0]
[socket]
path = "{socket}"
[reserved]
debug = true
[log]
level = "error"
[links.wifi]
type = "udp"
interface = "lo"
beacon_ms = 1000
"""
LAB_CONFIG = """[links.wifi]
beacon_ms = 500
[log]
level = "error"
[reserved]
debug = true
harvest = true
report = true
"""


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--robots", type=int, default=100)
    parser.add_argument("--lab", type=int, default=36, help="daemons that report (%(default)s)")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--pairs", type=int, default=7)
    return parser.parse_args()


def frame(robot, epoch, counter, pose, channel, text):
    """One air frame with one packet (docs/wire-format.md)."""
    x_mm, y_mm, theta = pose
    head = struct.pack(">HIHHB", robot, counter, 1, channel, 0) + struct.pack(
        ">BHHB", 0, len(text), epoch & 0xFFFF, 0)
    packet = head + text
    body = struct.pack(">hhHB", x_mm, y_mm, theta, 0) + struct.pack(">H", len(packet)) + packet
    return struct.pack(">2sBBHBBHII", b"ST", 1, 1, 18 + len(body), 0, 0, robot, epoch,
                       counter) + body


class Robots(threading.Thread):
    """Sends what so many robots would: each RATE_HZ times a second, evenly spread."""

    def __init__(self, count, channel):
        super().__init__(daemon=True)
        self.count, self.channel, self.ended, self.sent = count, channel, False, 0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF,
                               socket.inet_aton("127.0.0.1"))

    def run(self):
        start = time.monotonic()
        while not self.ended:
            turn, robot = divmod(self.sent, self.count)
            angle = turn / RATE_HZ * 0.5 + robot
            x_mm = robot % 10 * 500 + int(150 * math.cos(angle))
            y_mm = robot // 10 * 500 + int(150 * math.sin(angle))
            text = struct.pack("<d", time.clock_gettime(time.CLOCK_MONOTONIC)).ljust(20, b".")
            self.socket.sendto(frame(robot + 1, 0x1234 + robot, turn + 1,
                                     (x_mm, y_mm, int(angle / math.tau % 1 * 65535)),
                                     self.channel, text), (GROUP, PORT))
            self.sent += 1
            wait = start + self.sent / (self.count * RATE_HZ) - time.monotonic()
            if wait > 0.002:
                time.sleep(wait)

    def end(self):
        self.ended = True
        self.join()


class Process:
    """A program of ours, ended with the `with`."""

    def __init__(self, *command, **options):
        self.process = subprocess.Popen(list(map(str, command)), stdin=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL, text=True, **options)

    def cpu_s(self):
        tasks = pathlib.Path(f"/proc/{self.process.pid}/task").glob("*/schedstat")
        return sum(int(task.read_text(encoding="utf-8").split()[0]) for task in tasks) / 1e9

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.communicate(timeout=30)


class View(Process):
    def __init__(self, build, path, *options):
        super().__init__(build / "view/swarmtalk-view", "--socket", path, "--port", "0", *options,
                         stdout=subprocess.PIPE)
        line = self.process.stdout.readline()
        if not line:
            sys.exit("view_load.py: swarmtalk-view does not start")
        self.port = int(line.split("localhost:")[1].split("/")[0])

    def viewer(self):
        return WebSocket(self.port, protocol=PAGE, timeout=30)


def share(process, seconds, meanwhile=None):
    """Of a core that it takes."""
    before, start = process.cpu_s(), time.monotonic()
    if meanwhile:
        meanwhile(seconds)
    else:
        time.sleep(seconds)
    return (process.cpu_s() - before) / (time.monotonic() - start)


def look(viewer, seconds):
    """@return states a second, longest gap between two in ms, robots, median and p99 age in ms"""
    states, ages, gap, robots = 0, [], 0.0, 0
    start = last = time.monotonic()
    while time.monotonic() - start < seconds:
        message = json.loads(viewer.receive())
        now = time.monotonic()
        if message["t"] == "state":
            states += 1
            gap, last = max(gap, now - last), now
            robots = sum("x" in robot for robot in message["robots"])
        elif message["t"] == "msg":
            sent, = struct.unpack("<d", bytes.fromhex(message["hex"])[:8])
            ages.append((now - sent) * 1e3)
    ages.sort()
    return (states / seconds, gap * 1e3, robots, statistics.median(ages) if ages else math.nan,
            ages[int(len(ages) * .99)] if ages else math.nan)


def channel_number(build, path, name):
    done = subprocess.run([build / "cli/swarmtalk-cli", "--socket", path, "status", "--json"],
                          text=True, capture_output=True, check=True, timeout=30)
    return next(c["number"] for c in json.loads(done.stdout)["channels"] if c["name"] == name)


def wait_until(condition, what):
    deadline = time.monotonic() + 60
    while not condition():
        if time.monotonic() > deadline:
            sys.exit(f"view_load.py: no {what} within 60 s")
        time.sleep(0.05)


def hundred(options, folder):
    path = folder / "daemon.sock"
    config = folder / "daemon.toml"
    config.write_text(CONFIG.format(socket=path), encoding="utf-8")
    with Process(options.build / "daemon/swarmtalkd", "--config", config):
        wait_until(path.exists, "daemon")
        with View(options.build, path, "--channel", "state") as view:
            robots = Robots(options.robots, channel_number(options.build, path, "state"))
            robots.start()
            try:
                measure(options, view, robots)
            finally:
                robots.end()


def measure(options, view, robots):
    with view.viewer() as viewer:  # until all are there
        wait_until(lambda: look(viewer, 0.5)[2] >= options.robots, f"{options.robots} robots")
    sent, start = robots.sent, time.monotonic()
    alone = share(view, options.seconds)
    with view.viewer() as viewer:
        watched = share(view, options.seconds, lambda s: look(viewer, s))
    rate = (robots.sent - sent) / (time.monotonic() - start)
    print(f"{options.robots} robots, {rate:.0f} frames/s: {alone * 100:.1f} % of a core without "
          f"a viewer, {watched * 100:.1f} % with one (at most 50)", flush=True)
    results = {False: [], True: []}
    for pair in range(options.pairs):
        for stalled in (False, True) if pair % 2 == 0 else (True, False):
            results[stalled].append(one_run(view, options.seconds / 4, stalled))
    words = ("states/s", "longest gap ms", None, "message age p50 ms", "message age p99 ms",
             "CPU of the view %")
    print(f"a viewer beside one that reads, and beside one that has stopped reading: medians of "
          f"{options.pairs} pairs")
    for i, word in enumerate(words):
        if word is None:
            continue
        one, other = ([run[i] for run in results[stalled]] for stalled in (False, True))
        print(f"  {word:20} {statistics.median(one):8.1f} {statistics.median(other):8.1f}   "
              f"median ratio {statistics.median(b / a for a, b in zip(one, other)):.2f}")


def one_run(view, seconds, stalled):
    """What one viewer gets while another one reads, or does not."""
    watch = json.dumps({"op": "watch", "channel": "state"})
    with view.viewer() as viewer, view.viewer() as other:
        viewer.send(watch)
        other.send(watch)
        stop = threading.Event()
        reader = threading.Thread(target=lambda: read_until(other, stop), daemon=True)
        if not stalled:
            reader.start()
        look(viewer, 1)  # the other's queue is full by now, if it does not read
        before, start = view.cpu_s(), time.monotonic()
        result = look(viewer, seconds)
        used = (view.cpu_s() - before) / (time.monotonic() - start)
        stop.set()
        if not stalled:
            reader.join()
        return (*result, used * 100)


def read_until(viewer, stop):
    while not stop.is_set():
        viewer.receive()


class Air(threading.Thread):
    """Adds up the air of all reports on the wire of a lab; each robot of one cell hears it all."""

    def __init__(self, port, channel):
        super().__init__(daemon=True)
        self.channel, self.air_us, self.reports, self.ended = channel, 0.0, 0, False
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind((GROUP, port))
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                               socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1"))
        self.socket.settimeout(0.5)

    def run(self):
        while not self.ended:
            try:
                bytes_ = self.socket.recv(65536)
            except TimeoutError:
                continue
            at = 18 + (7 if bytes_[3] & 1 else 0)
            if bytes_[3] & 4:
                continue  # a beacon
            while at + 2 <= len(bytes_):
                size, = struct.unpack(">H", bytes_[at:at + 2])
                packet = bytes_[at + 2:at + 2 + size]
                at += 2 + size
                if len(packet) > 17 and struct.unpack(">H", packet[8:10])[0] == self.channel:
                    self.reports += 1
                    self.air_us += AIR_US + (size - 17 + AROUND_BYTES) * 8 / 6

    def end(self):
        self.ended = True
        self.join()
        self.socket.close()


def air(options, folder):
    config = folder / "lab.toml"
    config.write_text(LAB_CONFIG, encoding="utf-8")
    lab = [str(options.build / "lab/swarmtalk-lab"), "--name", f"view{os.getpid()}"]
    subprocess.run([*lab, "up", str(options.lab), "--medium", "udp", "--config", str(config)],
                   check=True, timeout=120, stdout=subprocess.DEVNULL)
    try:
        done = subprocess.run([*lab, "status", "--json"], text=True, capture_output=True,
                              check=True, timeout=60)
        sockets = [json.loads(line)["socket"] for line in done.stdout.splitlines()]
        number = channel_number(options.build, sockets[0], "harvest")
        port = 2166136261
        for letter in lab[2].encode():
            port = (port ^ letter) * 16777619 % 2 ** 32
        for viewers in (0, 1, 3):
            reports_of(options, sockets, number, 20000 + port % 10000, viewers)
    finally:
        subprocess.run([*lab, "down"], timeout=60, check=False, stdout=subprocess.DEVNULL)


def reports_of(options, sockets, number, port, viewers):
    views = [View(options.build, sockets[i * len(sockets) // 3]) for i in range(viewers)]
    pages = [view.viewer() for view in views]
    try:
        for page in pages:
            look(page, 3)  # the first reports
        wire = Air(port, number)
        wire.start()
        start = time.monotonic()
        threads = [threading.Thread(target=look, args=(page, options.seconds)) for page in pages]
        for thread in threads:
            thread.start()
        time.sleep(options.seconds)
        for thread in threads:
            thread.join()
        seconds = time.monotonic() - start
        wire.end()
        print(f"{len(sockets)} daemons in one cell, {viewers} viewers: "
              f"{wire.reports / seconds:.1f} reports/s, {wire.air_us / seconds / 1e4:.2f} % of the "
              "air (budget 1)", flush=True)
    finally:
        for page in pages:
            page.close()
        for view in views:
            view.__exit__()


def main():
    options = parse()
    options.build = options.build.resolve()
    if INSIDE not in os.environ:
        if os.geteuid() != 0:
            sys.exit("view_load.py: a network namespace needs root")
        os.environ[INSIDE] = "1"
        os.execvp("unshare", ["unshare", "--net", sys.executable, *sys.argv])
    for words in (("ip", "link", "set", "lo", "up"), ("ip", "link", "set", "lo", "multicast", "on"),
                  ("ip", "route", "add", "default", "dev", "lo")):
        subprocess.run(words, check=True)
    done = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], text=True,
                          capture_output=True, check=False)
    print(f"commit {done.stdout.strip() or 'unknown'}, {os.cpu_count()} cores, "
          f"Linux {platform.release()}, load average {os.getloadavg()[0]:.1f}", flush=True)
    with tempfile.TemporaryDirectory() as name:
        hundred(options, pathlib.Path(name))
        air(options, pathlib.Path(name))
    print(f"load average at the end {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
