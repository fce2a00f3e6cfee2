#!/usr/bin/python3
"""What a robot pays for its daemon, and what the others feel when one of its clients stops.

usage: benchmarks/daemon_load.py [--build build-test] [--pairs 9] [--seconds 10]

Two robots on a wire (root). Prints, of the receiving daemon: wake-ups and resident memory while
idle; the share of a core that 500 received frames/s take, without and with a program that
subscribes; the time from the kernel's receive stamp to the callback at 200 frames/s; and, with 64
clients, the p99 from send() to the callback of the others, in interleaved pairs of runs: all
running, and one stopped by SIGSTOP. CPU is /proc/PID/schedstat, which counts the kernel's work on
the daemon's behalf.
"""
import argparse
import json
import os
import pathlib
import platform
import signal
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
TIMEOUT_S = 120
CLIENTS = 64


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--pairs", type=int, default=9)
    parser.add_argument("--seconds", type=float, default=10)
    return parser.parse_args()


class Receiver:
    """A running `latency receive`."""

    def __init__(self, robot, app, count):
        self.process = robot.start(app, "receive", count, text=True, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, env=environment(robot))
        line = self.process.stderr.readline()
        if "ready" not in line:
            sys.exit(f"daemon_load.py: a receiver says: {line.strip()}")

    def result(self):
        out, _ = self.process.communicate(timeout=TIMEOUT_S)
        return json.loads(out)

    def stop(self):
        self.process.send_signal(signal.SIGSTOP)

    def kill(self):
        self.process.kill()
        self.process.communicate()


def environment(robot):
    return {**os.environ, "SWARMTALK_SOCKET": str(robot.socket)}


def send(robot, app, count, gap_us):
    done = subprocess.run(robot.robots.words(robot.name, app, "send", count, 64, gap_us),
                          env=environment(robot), text=True, capture_output=True,
                          timeout=TIMEOUT_S)
    if done.returncode != 0:
        sys.exit(f"daemon_load.py: the sender says: {done.stderr.strip()}")


def cpu_ns(pid):
    return int(pathlib.Path(f"/proc/{pid}/schedstat").read_text().split()[0])


def wake_ups(pid):
    text = pathlib.Path(f"/proc/{pid}/status").read_text()
    return int(text.split("\nvoluntary_ctxt_switches:")[1].split()[0])


def idle(robot, seconds):
    before = wake_ups(robot.daemon.pid)
    time.sleep(seconds)
    rate = (wake_ups(robot.daemon.pid) - before) / seconds
    print(f"idle for {seconds:.0f} s: {rate:.2f} wake-ups/s, resident {robot.memory_kb()} KiB")


def receiving(robots, app, rate_hz, seconds, subscribed):
    count = int(rate_hz * seconds)
    pid = robots[1].daemon.pid
    receiver = Receiver(robots[1], app, count) if subscribed else None
    started, before = time.monotonic(), cpu_ns(pid)
    send(robots[0], app, count, int(1e6 / rate_hz))
    passed = time.monotonic() - started
    share = (cpu_ns(pid) - before) / 1e9 / passed
    print(f"{count / passed:.0f} frames/s received, {'one' if subscribed else 'no'} subscriber: "
          f"{share * 100:.2f} % of a core, {share / count * passed * 1e6:.1f} us each")
    if receiver:
        result = receiver.result()
        print(f"  {result['received']} of {count} heard; kernel's receive stamp to callback: p50 "
              f"{result['from_kernel_p50_us']:.0f} us, p99 {result['from_kernel_p99_us']:.0f} us")


def crowd(robots, app, count, stopped):
    """@return p99 in us, the median over the clients that run, and the worst of them"""
    receivers = [Receiver(robots[1], app, count) for _ in range(CLIENTS)]
    odd = receivers.pop(CLIENTS // 2)
    if stopped:
        odd.stop()
    send(robots[0], app, count, 10000)
    results = [receiver.result() for receiver in receivers]
    odd.kill()
    missing = sum(count - result["received"] for result in results)
    if missing:
        sys.exit(f"daemon_load.py: {missing} messages did not reach clients that run")
    each = [result["p99_us"] for result in results]
    return statistics.median(each), max(each)


def crowds(robots, app, pairs):
    ratios, worst_ratios = [], []
    for pair in range(pairs):
        order = (False, True) if pair % 2 == 0 else (True, False)
        result = {stopped: crowd(robots, app, 200, stopped) for stopped in order}
        ratios.append(result[True][0] / result[False][0])
        worst_ratios.append(result[True][1] / result[False][1])
        print(f"  pair {pair + 1}: p99 {result[False][0]:.0f} us, one stopped "
              f"{result[True][0]:.0f} us; worst client {result[False][1]:.0f}, "
              f"{result[True][1]:.0f} us", flush=True)
    print(f"p99 of {CLIENTS - 1} clients with one stopped / without, median of {pairs} pairs: "
          f"{statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}); worst "
          f"client {statistics.median(worst_ratios):.2f}; resident {robots[1].memory_kb()} KiB")


def main():
    options = parse()
    if os.geteuid() != 0:
        sys.exit("daemon_load.py: network namespaces need root")
    os.environ["SWARMTALK_BUILD"] = str(options.build)
    sys.path.insert(0, str(ROOT / "tests/faults"))
    import swarm
    app = options.build.resolve() / "benchmarks/latency"
    done = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], text=True,
                          capture_output=True)
    print(f"commit {done.stdout.strip() or 'unknown'}, {os.cpu_count()} cores, "
          f"Linux {platform.release()}, load average {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as folder:
        with swarm.Swarm(2, pathlib.Path(folder), f"[limits]\nclients = {CLIENTS + 1}\n") as group:
            idle(group.robots[1], options.seconds)
            receiving(group.robots, app, 500, options.seconds, False)
            receiving(group.robots, app, 500, options.seconds, True)
            receiving(group.robots, app, 200, options.seconds, True)
            crowds(group.robots, app, options.pairs)


if __name__ == "__main__":
    main()
