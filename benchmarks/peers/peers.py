#!/usr/bin/python3
"""What a message costs from program to program: swarmtalkd, a minimal daemon, and other systems.

usage: benchmarks/peers/peers.py [--build build-test] [--runs 5] [--bytes 64] [--systems a,b]

Needs root: two network namespaces joined by a veth pair. In each round every system runs twice, in
turn: paced (one message every --gap-us, for the latency) and windowed (as fast as --window messages
that have not arrived allow, for rate and CPU). CPU is that of all processes on the way, programs,
daemons and broker, for each message. Prints medians, and the median of the ratios to the minimal
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
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))

import wire as wires  # noqa: E402

TIMEOUT_S = 60
NETWORK = wires.Robots.NETWORK
SYSTEMS = ("minimal", "swarmtalkd", "bare", "lcm", "cyclonedds", "mosquitto")


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
    return parser.parse_args()


class System:
    """Programs of one system, and the daemons it needs."""

    def __init__(self, name, build, folder):
        self.name = name
        self.folder = folder
        self.programs = build / "benchmarks/peers"
        self.build = build
        self.daemons = []
        self.environments = [{}, {}]
        self.log = open(folder / f"{name}.log", "w", encoding="utf-8")

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
        for index, namespace in enumerate(wire.names):
            if self.name == "bare":
                self.environments[index] = {"BARE_INTERFACE": "wlan0"}
            elif self.name == "lcm":
                self.environments[index] = {}
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
                         + (self.folder / f"{self.name}.log").read_text())
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

    def measure(self, wire, count, size_bytes, pace):
        """One run. @return received, p50_us, p99_us, rate_per_s, cpu_us for each message"""
        shared = self.folder / "shared"
        shared.unlink(missing_ok=True)
        before_us = self.cpu_us()
        processes = []
        for index, words in ((1, ["receive"]), (0, ["send"])):
            command = [self.program(), *words, shared, count, size_bytes]
            if index == 0:
                command.append(pace)
            processes.append(wire.start(
                wire.names[index], *command, text=True, stdout=subprocess.PIPE, stderr=self.log,
                env={**os.environ, **self.environments[index]}))
            if index == 1:
                self.wait_ready(shared, processes[0])
        receiver, sender = processes
        sent = json.loads(sender.communicate(timeout=TIMEOUT_S)[0])
        got = json.loads(receiver.communicate(timeout=TIMEOUT_S)[0])
        cpu_us = got["cpu_us"] + sent["cpu_us"] + self.cpu_us() - before_us
        return {"lost": count - got["received"], "p50_us": got["p50_us"], "p99_us": got["p99_us"],
                "rate_k": got["received"] / max(got["seconds"], 1e-9) / 1000,
                "cpu_us": cpu_us / max(got["received"], 1)}

    @staticmethod
    def wait_ready(shared, process):
        deadline = time.monotonic() + 10
        while time.monotonic() < deadline and process.poll() is None:
            with contextlib.suppress(FileNotFoundError):
                with open(shared, "rb") as file:
                    if file.read(1) == b"\x01":
                        time.sleep(0.1)
                        return
            time.sleep(0.01)
        sys.exit(f"peers.py: {process.args} does not get ready (ended: {process.poll()})")


def accepts(path):
    """A socket file is there before its daemon listens."""
    with socket.socket(socket.AF_UNIX) as client:
        return client.connect_ex(str(path)) == 0


def measure_all(options, wire, folder):
    systems = []
    for name in options.systems.split(","):
        system = System(name, options.build, folder)
        reason = system.missing()
        if reason is None:
            systems.append(system)
        else:
            print(f"{name}: left out, {reason}")
    results = {system.name: [] for system in systems}
    for _ in range(options.runs):
        for system in systems:
            system.start(wire)
            try:
                paced = system.measure(wire, options.paced, options.bytes, options.gap_us)
                windowed = system.measure(wire, options.windowed, options.bytes,
                                          f"window={options.window}")
            finally:
                system.stop()
            results[system.name].append({
                "p50_us": paced["p50_us"], "p99_us": paced["p99_us"],
                "paced_cpu_us": paced["cpu_us"], "rate_k": windowed["rate_k"],
                "cpu_us": windowed["cpu_us"], "lost": paced["lost"] + windowed["lost"]})
    return results


COLUMNS = (("p50_us", "p50 us"), ("p99_us", "p99 us"), ("paced_cpu_us", "CPU us paced"),
           ("rate_k", "rate 1000/s"), ("cpu_us", "CPU us windowed"))


def show(options, results):
    print(f"{options.bytes} B; paced every {options.gap_us} us ({options.paced} messages); window "
          f"{options.window} ({options.windowed} messages); median (lowest to highest) of "
          f"{options.runs} interleaved runs")
    commit = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], text=True,
                            capture_output=True, check=False).stdout.strip() or "unknown"
    print(f"commit {commit}, {os.cpu_count()} cores, Linux {platform.release()}\n")
    print(f"{'':12}" + "".join(f"{title:>25}" for _, title in COLUMNS) + f"{'lost':>7}")
    for name, runs in results.items():
        cells = ""
        for key, _ in COLUMNS:
            values = [each[key] for each in runs]
            text = f"{statistics.median(values):.2f} ({min(values):.1f} to {max(values):.1f})"
            cells += f"{text:>25}"
        print(f"{name:12}{cells}{sum(each['lost'] for each in runs):>7}")
    if "minimal" not in results:
        return
    print("\nmedian of the ratios to the minimal daemon, round by round")
    for name, runs in results.items():
        cells = ""
        for key, _ in COLUMNS:
            ratios = [each[key] / base[key] for each, base in zip(runs, results["minimal"])]
            cells += f"{statistics.median(ratios):>25.2f}"
        print(f"{name:12}{cells}")


def main():
    options = parse()
    if os.geteuid() != 0:
        sys.exit("peers.py: network namespaces need root")
    with tempfile.TemporaryDirectory(prefix="swarmtalk-peers-") as folder, \
            wires.Robots(2, "stp") as wire:
        results = measure_all(options, wire, pathlib.Path(folder))
    show(options, results)


if __name__ == "__main__":
    main()
