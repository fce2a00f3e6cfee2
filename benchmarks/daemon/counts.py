#!/usr/bin/python3
"""What a message costs, in counts that a busy machine hardly changes.

usage: benchmarks/daemon/counts.py [--build build-test] [--receivers 1,8,35] [--no-instructions]
                                   [--functions 12] [--gap-us 5000] [--config FILE]

Needs root (network namespaces on a bridge), strace and valgrind. One robot sends 64 B, one message
at a time and 16 at once, to 1, 8 and 35 others; one daemon, one program a robot. Then as many
robots all publish 10 messages/s, spread, and hear each other. Prints, for each message (in a swarm
for each delivery), the system calls by name, the wake-ups (voluntary context switches) and the
instructions of the process alone, without the kernel's (callgrind), of the sender's program and
daemon and of the first receiver's; wake-ups of receivers are the mean over all of them. Calls for
each wake-up are told as well: on a loaded machine a process wakes once for several messages.
Instructions are the difference of two runs of different length, so that start and end are not in
them; in callgrind's runs the daemons are slow, and messages come together.
"""
import argparse
import contextlib
import os
import pathlib
import platform
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))

import wire as wires  # noqa: E402

TIMEOUT_S = 180
BYTES = 64
# Name: messages at once, microseconds between, messages of a short and a long run.
SCENES = {"one at a time": (1, 5000, 100, 500), "16 at once": (16, 200000, 160, 800)}
# The call that is made once in each turn that has messages.
TURNS = {"sender's daemon": "pread64", "receiver's daemon": "recvmmsg",
         "receiver's program": "recvfrom"}
SWARM_GAP_US = 100000
SWARM_MESSAGES = (10, 50)


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--daemon", type=pathlib.Path, help="another swarmtalkd than the build's")
    parser.add_argument("--receivers", default="1,8,35")
    parser.add_argument("--no-instructions", action="store_true")
    parser.add_argument("--functions", type=int, default=12,
                        help="of each process, with one receiver")
    parser.add_argument("--gap-us", type=int, default=5000, help="between messages, one at a time")
    parser.add_argument("--config", type=pathlib.Path, help="what the daemons have in addition")
    return parser.parse_args()


def wake_ups(pid):
    text = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return int(text.split("\nvoluntary_ctxt_switches:")[1].split()[0])


class Strace:
    """Counts the system calls of a running process."""

    def __init__(self, folder, name, pid):
        self.path = folder / f"{name}.calls"
        self.process = subprocess.Popen(
            ["strace", "-f", "-c", "-U", "name,calls", "-o", str(self.path), "-p", str(pid)],
            stderr=subprocess.PIPE, text=True)
        line = self.process.stderr.readline()
        if "attached" not in line:
            sys.exit(f"counts.py: strace says: {line.strip()}")

    def end(self):
        """@return {call: times}"""
        self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=TIMEOUT_S)
        return read_calls(self.path)


def read_calls(path):
    calls = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        found = re.match(r"\s*(\w+)\s+(\d+)\s*$", line)
        if found and found[1] != "total":
            calls[found[1]] = int(found[2])
    return calls


class Swarm:
    """Robots on a bridge, each with its daemon. Those in `counted` run in callgrind."""

    def __init__(self, options, robots, folder, count, counted=()):
        self.options, self.robots, self.folder = options, robots, folder
        self.daemons = []
        self.log = open(folder / "log", "a", encoding="utf-8")
        for index in range(count):
            self.socket(index).unlink(missing_ok=True)
            config = folder / f"{index}.toml"
            config.write_text(f'[node]\nid = {index + 1}\n[socket]\npath = "{self.socket(index)}"\n'
                              '[links.wire]\ntype = "raw_l2"\ninterface = "wlan0"\n'
                              + (options.config.read_text() if options.config else ""),
                              encoding="utf-8")
            program = options.daemon or options.build / "daemon/swarmtalkd"
            before = self.valgrind(f"daemon{index}", index in counted)
            self.daemons.append(robots.start(robots.names[index], *before, program, "--config",
                                             config, stderr=self.log))
        for index in range(count):
            self.wait_for_socket(index)

    def socket(self, index):
        return self.folder / f"{index}.sock"

    def out(self, name):
        return self.folder / f"{name}.callgrind"

    def valgrind(self, name, is_counted):
        if not is_counted:
            return []
        return ["valgrind", "-q", "--tool=callgrind", f"--callgrind-out-file={self.out(name)}"]

    def wait_for_socket(self, index):
        deadline = time.monotonic() + 30
        while not self.socket(index).exists():
            if time.monotonic() > deadline or self.daemons[index].poll() is not None:
                sys.exit("counts.py: a daemon did not start:\n"
                         + (self.folder / "log").read_text(encoding="utf-8"))
            time.sleep(0.02)

    def start(self, index, *words, before=(), **options):
        environment = {**os.environ, "SWARMTALK_SOCKET": str(self.socket(index))}
        return self.robots.start(self.robots.names[index], *before, *words, text=True,
                                 env=environment, **options)

    def receiver(self, index, count, is_counted=False):
        process = self.start(index, self.options.build / "benchmarks/latency", "receive", count,
                             before=self.valgrind(f"program{index}", is_counted),
                             stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        said = ""
        while "ready" not in said:
            said = process.stderr.readline()
            if not said:
                sys.exit("counts.py: a receiver did not get ready")
        # Nobody reads on: a full pipe would hold it up.
        threading.Thread(target=process.stderr.read, daemon=True).start()
        return process

    def sender_words(self, count, scene):
        burst, gap_us = SCENES[scene][:2]
        gap_us = self.options.gap_us if burst == 1 else gap_us
        return [self.options.build / "benchmarks/latency", "send", count, BYTES, gap_us, burst]

    def stop(self):
        for daemon in self.daemons:
            daemon.terminate()
        for daemon in self.daemons:
            daemon.wait(timeout=TIMEOUT_S)


def finish(process, what):
    if process.wait(timeout=TIMEOUT_S) != 0:
        sys.exit(f"counts.py: {what} failed")


@contextlib.contextmanager
def swarm(*words, **options):
    group = Swarm(*words, **options)
    try:
        yield group
    finally:
        group.stop()


def kill(processes):
    for process in processes:
        process.kill()
        process.wait()


def count_wake_ups(options, robots, folder, receivers, scene):
    count = SCENES[scene][3]
    with swarm(options, robots, folder, receivers + 1) as group:
        # One more than comes: they stay until they have been looked at.
        programs = [group.receiver(index, count + 1) for index in range(1, receivers + 1)]
        pids = [each.pid for each in [*group.daemons, *programs]]
        before = [wake_ups(pid) for pid in pids]
        sender = group.start(0, *group.sender_words(count, scene), stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(sender.pid, 0)
        sender.returncode = os.waitstatus_to_exitcode(status)
        if sender.returncode != 0:
            sys.exit("counts.py: the sender failed")
        time.sleep(0.3)
        each = [(wake_ups(pid) - was) / count for pid, was in zip(pids, before)]
        kill(programs)
    return {"sender's program": usage.ru_nvcsw / count, "sender's daemon": each[0],
            "receiver's daemon": sum(each[1:receivers + 1]) / receivers,
            "receiver's program": sum(each[receivers + 1:]) / receivers}


def count_calls(options, robots, folder, receivers, scene):
    short, count = SCENES[scene][2:]
    with swarm(options, robots, folder, receivers + 1) as group:
        programs = [group.receiver(index, short + count + 1) for index in range(1, receivers + 1)]
        own = []
        for messages in (short, count):
            traced = {}
            if messages == count:
                traced = {"sender's daemon": group.daemons[0],
                          "receiver's daemon": group.daemons[1], "receiver's program": programs[0]}
            traced = {name: Strace(folder, name.replace(" ", "-"), process.pid)
                      for name, process in traced.items()}
            path = folder / "sender.calls"
            sender = group.start(
                0, *group.sender_words(messages, scene), stdout=subprocess.DEVNULL,
                before=["strace", "-f", "-c", "-U", "name,calls", "-o", path])
            finish(sender, "the sender")
            time.sleep(0.3)
            own.append(read_calls(path))
            calls = {name: each.end() for name, each in traced.items()}
        kill(programs)
    result = {"sender's program": {call: (own[1][call] - own[0].get(call, 0)) / (count - short)
                                   for call in own[1]}}
    for name, each in calls.items():
        result[name] = {call: times / count for call, times in each.items()}
    return result


def read_instructions(path):
    """@return instructions in all, and by function"""
    text = subprocess.run(["callgrind_annotate", "--threshold=100", str(path)], text=True,
                          capture_output=True, timeout=TIMEOUT_S, check=True).stdout
    total = 0
    functions = {}
    for line in text.splitlines():
        found = re.match(r"\s*([\d,]+) \(\s*[\d.]+%\)\s+(.*)$", line)
        if not found:
            continue
        number = int(found[1].replace(",", ""))
        if found[2].startswith("PROGRAM TOTALS"):
            total = number
            continue
        name = re.sub(r" \[[^\]]*\]$", "", found[2].split(":", 1)[-1])
        functions[name] = functions.get(name, 0) + number
    return total, functions


def count_instructions(options, robots, folder, receivers, scene):
    names = {"sender's daemon": "daemon0", "receiver's daemon": "daemon1",
             "receiver's program": "program1"}
    runs = []
    for count in SCENES[scene][2:]:
        with swarm(options, robots, folder, receivers + 1, counted=(0, 1)) as group:
            programs = [group.receiver(index, count, index == 1)
                        for index in range(1, receivers + 1)]
            finish(group.start(0, *group.sender_words(count, scene), stdout=subprocess.DEVNULL),
                   "the sender")
            for program in programs:
                finish(program, "a receiver")
        runs.append({name: read_instructions(group.out(stem)) for name, stem in names.items()})
    short, count = SCENES[scene][2:]
    result = {}
    for name in names:
        (fewer, functions_before), (more, functions) = runs[0][name], runs[1][name]
        by_function = {each: (number - functions_before.get(each, 0)) / (count - short)
                       for each, number in functions.items()}
        result[name] = ((more - fewer) / (count - short), by_function)
    return result


def count_swarm(options, robots, folder, count):
    """All publish and hear all. @return for each delivery: {"daemon": ..., "program": ...}"""
    app = options.build / "benchmarks/peers/peers_swarmtalk_app"
    runs = []
    for messages in SWARM_MESSAGES:
        shared = folder / "shared"
        shared.unlink(missing_ok=True)
        with swarm(options, robots, folder, count) as group:
            programs = [group.start(index, app, "swarm", shared, messages, BYTES, SWARM_GAP_US,
                                    index, count, stdout=subprocess.PIPE)
                        for index in range(count)]
            time.sleep(1.0)  # every robot waits for all others, so nobody has begun
            before = [wake_ups(each.pid) for each in group.daemons]
            usages = []
            for program in programs:
                _, status, usage = os.wait4(program.pid, 0)
                program.returncode = os.waitstatus_to_exitcode(status)
                program.stdout.close()
                usages.append(usage.ru_nvcsw)
            daemons = sum(wake_ups(each.pid) for each in group.daemons) - sum(before)
        runs.append((daemons, sum(usages)))
    deliveries = (SWARM_MESSAGES[1] - SWARM_MESSAGES[0]) * count * (count - 1)
    return {"daemon": (runs[1][0] - runs[0][0]) / deliveries,
            "program": (runs[1][1] - runs[0][1]) / deliveries}


def show(scene, receivers, wakes, calls, instructions):
    for name in wakes:
        by_name = sorted(calls[name].items(), key=lambda item: -item[1])
        text = ", ".join(f"{call} {times:.2f}" for call, times in by_name if times >= 0.02)
        count = f"{instructions[name][0]:.0f}" if name in instructions else ""
        turns = calls[name].get(TURNS.get(name), 0)
        each = f"{sum(calls[name].values()) / turns:.2f}" if turns else ""
        print(f"| {scene} | {receivers} | {name} | {sum(calls[name].values()):.2f} | {each} | "
              f"{wakes[name]:.2f} | {count} | {text} |", flush=True)


def main():
    options = parse()
    options.build = options.build.resolve()
    if os.geteuid() != 0:
        sys.exit("counts.py: network namespaces need root")
    commit = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], text=True,
                            capture_output=True, check=False).stdout.strip() or "unknown"
    print(f"commit {commit}, {os.cpu_count()} cores, Linux {platform.release()}, load average "
          f"{os.getloadavg()[0]:.1f}\n")
    numbers = [int(number) for number in options.receivers.split(",")]
    functions = []
    print("| scene | receivers | process | calls | in a turn | wake-ups | instructions | "
          "calls by name |\n|---|---|---|---|---|---|---|---|")
    for receivers in numbers:
        with tempfile.TemporaryDirectory(prefix="swarmtalk-counts-") as folder, \
                wires.Robots(receivers + 1, "stcount") as robots:
            where = (options, robots, pathlib.Path(folder), receivers)
            for scene in SCENES:
                counted = {} if options.no_instructions else count_instructions(*where, scene)
                show(scene, receivers, count_wake_ups(*where, scene), count_calls(*where, scene),
                     counted)
                if receivers == numbers[0]:
                    functions.append((scene, counted))
    print("\n| robots that all publish and hear all | wake-ups of a daemon for each delivery | "
          "of a program |\n|---|---|---|")
    for receivers in numbers:
        with tempfile.TemporaryDirectory(prefix="swarmtalk-counts-") as folder, \
                wires.Robots(receivers + 1, "stcount") as robots:
            each = count_swarm(options, robots, pathlib.Path(folder), receivers + 1)
            print(f"| {receivers + 1} | {each['daemon']:.2f} | {each['program']:.2f} |", flush=True)
    for scene, counted in functions:
        for name, (_, by_function) in counted.items():
            top = sorted(by_function.items(), key=lambda item: -item[1])[:options.functions]
            print(f"\n{scene}, {name}: instructions for each message, with one receiver")
            for function, number in top:
                print(f"  {number:8.0f}  {function[:90]}")


if __name__ == "__main__":
    main()
