#!/usr/bin/python3
"""What a message costs from program to program: swarmtalkd, a minimal daemon, and other systems.

usage: benchmarks/peers/peers.py [--build build-test] [--runs 5] [--bytes 64] [--systems a,b]
                                 [--scenes two,eight,swarm]

Needs root: network namespaces, two joined by a veth pair, more by a bridge. In each round every
system runs in turn. Scene *two*: one sender, one receiver; *eight*: one sender, eight receivers, a
robot each. Both run paced (one message every --gap-us, for the latency) and windowed (as fast as
--window messages allow that the slowest receiver has not got, for rate and CPU). Scene *swarm*:
--robots robots all publish a message every --swarm-gap-us, their phases spread, and hear each
other. CPU is that of all processes on the way, programs, daemons and broker: for each message, in
the swarm for each message delivered. Prints medians, and the median of the ratios to the minimal
daemon in the same round. A system whose programs were not built is left out and named.
"""
import argparse
import contextlib
import json
import os
import pathlib
import platform
import shutil
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))

import wire as wires  # noqa: E402

TIMEOUT_S = 120
NETWORK = wires.Robots.NETWORK
SYSTEMS = ("minimal", "swarmtalkd", "bare", "lcm", "zmq", "cyclonedds", "mosquitto")
EIGHT = 8


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--bytes", type=int, default=64)
    parser.add_argument("--gap-us", type=int, default=500)
    parser.add_argument("--paced", type=int, default=1000, help="messages of a paced run")
    parser.add_argument("--windowed", type=int, default=60000, help="messages of a windowed run")
    parser.add_argument("--window", type=int, default=256)
    parser.add_argument("--systems", default=",".join(SYSTEMS))
    parser.add_argument("--scenes", default="two")
    parser.add_argument("--robots", type=int, default=36, help="of the swarm, at most 64")
    parser.add_argument("--swarm-gap-us", type=int, default=100000)
    parser.add_argument("--swarm-messages", type=int, default=50, help="of each robot")
    parser.add_argument("--control", action="store_true",
                        help="the minimal daemon once more, beside itself")
    return parser.parse_args()


class System:
    """Programs of one system, and the daemons it needs."""

    def __init__(self, label, build, folder):
        self.label = label
        self.name = label.removesuffix("-again")
        self.folder = folder
        self.programs = build / "benchmarks/peers"
        self.build = build
        self.daemons = []
        self.environments = []
        self.log = open(folder / f"{label}.log", "w", encoding="utf-8")

    def program(self):
        stem = {"swarmtalkd": "swarmtalk", "cyclonedds": "dds"}.get(self.name, self.name)
        return self.programs / f"peers_{stem}_app"

    def missing(self):
        if not self.program().exists():
            return f"{self.program().name} was not built"
        if self.name == "mosquitto" and not shutil.which("mosquitto", path="/usr/sbin:/usr/bin"):
            return "no mosquitto"
        return None

    def start(self, wire):
        """Starts the daemons, if any."""
        self.environments = [{} for _ in wire.names]
        peers = ",".join(f"{NETWORK}.{number}" for number in range(1, len(wire.names) + 1))
        for index, namespace in enumerate(wire.names):
            if self.name == "bare":
                self.environments[index] = {"BARE_INTERFACE": "wlan0"}
            elif self.name == "zmq":
                self.environments[index] = {"ZMQ_PEERS": peers}
            elif self.name == "minimal":
                path = self.folder / f"minimal{index}"
                self.add(wire, namespace, path, self.programs / "peers_minimal_daemon", "wlan0",
                         path)
                self.environments[index] = {"MINIMAL_SOCKET": str(path)}
            elif self.name == "swarmtalkd":
                path = self.folder / f"swarmtalkd{index}"
                config = self.folder / f"swarmtalkd{index}.toml"
                config.write_text(f'[node]\nid = {index + 1}\n[socket]\npath = "{path}"\n'
                                  '[links.wire]\ntype = "raw_l2"\ninterface = "wlan0"\n')
                self.add(wire, namespace, path, self.build / "daemon/swarmtalkd", "--config",
                         config)
                self.environments[index] = {"SWARMTALK_SOCKET": str(path)}
            elif self.name == "mosquitto":
                self.environments[index] = {"MQTT_HOST": f"{NETWORK}.1"}
        if self.name == "mosquitto":
            config = self.folder / "mosquitto.conf"
            config.write_text(f"listener 1883 {NETWORK}.1\nallow_anonymous true\n"
                              "set_tcp_nodelay true\nmax_queued_messages 10000\n")
            self.add(wire, wire.names[0], None, "/usr/sbin/mosquitto", "-c", config)
            time.sleep(0.5)

    def add(self, wire, namespace, path, *command):
        if path is not None:
            path.unlink(missing_ok=True)
        daemon = wire.start(namespace, *command, stdout=self.log, stderr=self.log)
        self.daemons.append(daemon)
        deadline = time.monotonic() + 10
        while path is not None and not accepts(path):
            if time.monotonic() > deadline or daemon.poll() is not None:
                sys.exit(f"peers.py: {command[0]} did not start: "
                         + (self.folder / f"{self.label}.log").read_text())
            time.sleep(0.02)

    def stop(self):
        for daemon in self.daemons:
            daemon.terminate()
            daemon.wait(timeout=10)
        self.daemons = []

    def cpu_us(self):
        """CPU of the daemons so far; `ip netns exec` becomes the command, so the pid is theirs."""
        return sum(int(task.read_text().split()[0]) / 1000 for daemon in self.daemons
                   for task in pathlib.Path(f"/proc/{daemon.pid}/task").glob("*/schedstat"))

    def program_of(self, wire, index, *words):
        return wire.start(wire.names[index], self.program(), *words, text=True,
                          stdout=subprocess.PIPE, stderr=self.log,
                          env={**os.environ, **self.environments[index]})

    def fresh_memory(self):
        shared = self.folder / "shared"
        shared.unlink(missing_ok=True)
        return shared

    def results(self, processes):
        try:
            return [json.loads(each.communicate(timeout=TIMEOUT_S)[0]) for each in processes]
        except (subprocess.TimeoutExpired, json.JSONDecodeError) as error:
            for each in processes:
                each.kill()
            sys.exit(f"peers.py: {self.label}: {error}\n"
                     + (self.folder / f"{self.label}.log").read_text())

    def measure(self, wire, count, size_bytes, pace):
        """One sender, all others receive. @return lost, p50_us, p99_us, rate_k, cpu_us a message"""
        shared = self.fresh_memory()
        before_us = self.cpu_us()
        receivers = len(wire.names) - 1
        processes = []
        for index in range(receivers):
            processes.append(self.program_of(wire, index + 1, "receive", shared, count, size_bytes,
                                             index))
        self.wait_ready(shared, processes)
        processes.append(self.program_of(wire, 0, "send", shared, count, size_bytes, pace,
                                         receivers))
        *got, sent = self.results(processes)
        cpu_us = sum(each["cpu_us"] for each in [*got, sent]) + self.cpu_us() - before_us
        slowest = max(got, key=lambda each: each["seconds"])
        return {"lost": receivers * count - sum(each["received"] for each in got),
                "p50_us": statistics.median(each["p50_us"] for each in got),
                "p99_us": statistics.median(each["p99_us"] for each in got),
                "rate_k": slowest["received"] / max(slowest["seconds"], 1e-9) / 1000,
                "cpu_us": cpu_us / count}

    def measure_swarm(self, wire, count, size_bytes, gap_us):
        """All robots publish and hear. @return lost, p50_us, p99_us, cpu_us for each delivery"""
        shared = self.fresh_memory()
        robots = len(wire.names)
        processes = [self.program_of(wire, index, "swarm", shared, count, size_bytes, gap_us, index,
                                     robots) for index in range(robots)]
        begin = time.monotonic() + TIMEOUT_S
        begin_ns = 0
        while begin_ns == 0:
            if time.monotonic() > begin or any(each.poll() is not None for each in processes):
                sys.exit(f"peers.py: {self.label}: the swarm does not begin:\n"
                         + (self.folder / f"{self.label}.log").read_text())
            time.sleep(0.05)
            begin_ns = self.begin_ns(shared)
        time.sleep(max(0.0, begin_ns / 1e9 - time.monotonic() - 0.25))  # as the programs count
        before_us = self.cpu_us()
        while self.done(shared) < robots and any(each.poll() is None for each in processes):
            time.sleep(0.05)
        daemons_us = self.cpu_us() - before_us
        got = self.results(processes)
        received = sum(each["received"] for each in got)
        return {"lost": robots * (robots - 1) * count - received,
                "p50_us": statistics.median(each["p50_us"] for each in got),
                "p99_us": statistics.median(each["p99_us"] for each in got),
                "cpu_us": (sum(each["cpu_us"] for each in got) + daemons_us) / max(received, 1)}

    @staticmethod
    def done(shared):
        with open(shared, "rb") as file:
            return struct.unpack("<IIq", file.read(16))[1]

    @staticmethod
    def begin_ns(shared):
        try:
            with open(shared, "rb") as file:
                return struct.unpack("<IIq", file.read(16))[2]
        except (FileNotFoundError, struct.error):
            return 0

    def wait_ready(self, shared, processes):
        deadline = time.monotonic() + 20
        while time.monotonic() < deadline and all(each.poll() is None for each in processes):
            with contextlib.suppress(FileNotFoundError, struct.error):
                with open(shared, "rb") as file:
                    if struct.unpack("<I", file.read(4))[0] == len(processes):
                        time.sleep(0.1)
                        return
            time.sleep(0.01)
        sys.exit(f"peers.py: {self.label}: the receivers do not get ready:\n"
                 + (self.folder / f"{self.label}.log").read_text())


def accepts(path):
    """A socket file is there before its daemon listens."""
    with socket.socket(socket.AF_UNIX) as client:
        return client.connect_ex(str(path)) == 0


def measure_all(options, scene, wire, folder):
    systems = []
    names = options.systems.split(",")
    if options.control:
        names.append("minimal-again")
    for name in names:
        system = System(name, options.build, folder)
        reason = system.missing()
        if scene == "swarm" and system.name == "bare":
            reason = "it has no swarm"
        if reason is None:
            systems.append(system)
        else:
            print(f"{name}: left out, {reason}")
    results = {system.label: [] for system in systems}
    for _ in range(options.runs):
        for system in systems:
            system.start(wire)
            try:
                results[system.label].append(measure_once(options, scene, system, wire))
            finally:
                system.stop()
    return results


def measure_once(options, scene, system, wire):
    if scene == "swarm":
        return system.measure_swarm(wire, options.swarm_messages, options.bytes,
                                    options.swarm_gap_us)
    paced = system.measure(wire, options.paced, options.bytes, options.gap_us)
    windowed = system.measure(wire, options.windowed // (1 if scene == "two" else 4), options.bytes,
                              f"window={options.window}")
    return {"p50_us": paced["p50_us"], "p99_us": paced["p99_us"], "paced_cpu_us": paced["cpu_us"],
            "rate_k": windowed["rate_k"], "cpu_us": windowed["cpu_us"],
            "lost": paced["lost"] + windowed["lost"]}


COLUMNS = (("p50_us", "p50 us"), ("p99_us", "p99 us"), ("paced_cpu_us", "CPU us paced"),
           ("rate_k", "rate 1000/s"), ("cpu_us", "CPU us windowed"))
SWARM_COLUMNS = (("p50_us", "p50 us"), ("p99_us", "p99 us"), ("cpu_us", "CPU us a delivery"))


def title(options, scene):
    if scene == "swarm":
        return (f"{options.robots} robots, each {options.swarm_messages} messages of "
                f"{options.bytes} B, one every {options.swarm_gap_us / 1000:g} ms, to all others")
    receivers = 1 if scene == "two" else EIGHT
    return (f"{receivers} receiver{'s' * (receivers > 1)}; {options.bytes} B; paced every "
            f"{options.gap_us} us ({options.paced} messages); window {options.window} "
            f"({options.windowed // (1 if scene == 'two' else 4)} messages)")


def show(options, scene, results):
    columns = SWARM_COLUMNS if scene == "swarm" else COLUMNS
    print(f"{title(options, scene)}; median (lowest to highest) of {options.runs} interleaved runs")
    commit = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], text=True,
                            capture_output=True, check=False).stdout.strip() or "unknown"
    print(f"commit {commit}, {os.cpu_count()} cores, Linux {platform.release()}, load average "
          f"{os.getloadavg()[0]:.1f}\n")
    print(f"{'':13}" + "".join(f"{heading:>25}" for _, heading in columns) + f"{'lost':>7}")
    for name, runs in results.items():
        cells = ""
        for key, _ in columns:
            values = [each[key] for each in runs]
            text = f"{statistics.median(values):.2f} ({min(values):.1f} to {max(values):.1f})"
            cells += f"{text:>25}"
        print(f"{name:13}{cells}{sum(each['lost'] for each in runs):>7}")
    if "minimal" not in results:
        return
    print("\nmedian of the ratios to the minimal daemon, round by round")
    for name, runs in results.items():
        cells = ""
        for key, _ in columns:
            ratios = [each[key] / base[key] for each, base in zip(runs, results["minimal"])]
            cells += f"{statistics.median(ratios):>25.2f}"
        print(f"{name:13}{cells}")
    print(flush=True)


def main():
    options = parse()
    if os.geteuid() != 0:
        sys.exit("peers.py: network namespaces need root")
    robots = {"two": 2, "eight": EIGHT + 1, "swarm": options.robots}
    for scene in options.scenes.split(","):
        with tempfile.TemporaryDirectory(prefix="swarmtalk-peers-") as folder, \
                wires.Robots(robots[scene], "stp") as wire:
            show(options, scene, measure_all(options, scene, wire, pathlib.Path(folder)))


if __name__ == "__main__":
    main()
