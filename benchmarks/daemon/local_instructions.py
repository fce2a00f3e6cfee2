#!/usr/bin/env python3
"""Instructions of daemons for a message of 64 bytes from one program to another on the same robot.

    benchmarks/daemon/local_instructions.py BUILD...

Each BUILD is a folder with daemon/swarmtalkd; the first is what the others are compared with.
Counted by valgrind's callgrind, the difference of 3,520 and 320 messages, so that start and end are
not in it; nor is the kernel's part, nor the programs'. The daemon has a UDP link on lo, on which
each message leaves as well. A count depends a little on how messages meet in a turn of the loop:
the smaller of two runs is told.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
MESSAGES = (320, 3520)
RUNS = 2
BYTES = 64


def talk(at_once):
    """Sends the messages over and over, `at_once` at a time; waits until all were heard."""
    sys.path.insert(0, str(ROOT / "tests/hostile/attacks"))
    from local_client import Client, Daemon, field, frame  # takes SWARMTALK_BUILD when imported
    messages = int(os.environ["MESSAGES"])
    out = os.environ["CALLGRIND_OUT"]
    with Daemon(command=["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null",
                         f"--log-file={out}"]) as daemon:
        listener, speaker = Client(daemon.socket), Client(daemon.socket)
        for each in (listener, speaker):
            each.take()
        assert isinstance(listener.subscribe("c", keep_last=100), int)
        publisher = speaker.advertise("c", queue=64)
        for first in range(1, messages + 1, at_once):
            speaker.socket.sendall(b"".join(
                frame(field(11, field(1, publisher) + field(2, number) + field(3, BYTES * b"x")))
                for number in range(first, first + at_once)))
            for client, kind in ((listener, 13), (speaker, 12)):
                heard = 0
                while heard < at_once:
                    answer = client.take()
                    assert 3 not in answer, answer
                    heard += kind in answer
                    if kind in answer and kind == 12:
                        break  # one "sent" may tell of several
        daemon.process.terminate()
        daemon.process.wait(60)


def count(build, messages, at_once):
    with tempfile.NamedTemporaryFile("r") as log:
        environment = {**os.environ, "SWARMTALK_BUILD": build, "MESSAGES": str(messages),
                       "CALLGRIND_OUT": log.name, "SWARMTALK_WAIT_S": "120"}
        subprocess.run([sys.executable, "-B", __file__, "--talk", str(at_once)], check=True,
                       env=environment, timeout=600)
        return int(re.search(r"Collected : (\d+)", log.read())[1])


def per_message(build, at_once):
    few, many = (min(count(build, messages, at_once) for _ in range(RUNS)) for messages in MESSAGES)
    return (many - few) / (MESSAGES[1] - MESSAGES[0])


def main():
    if sys.argv[1:2] == ["--talk"]:
        return talk(int(sys.argv[2]))
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    first = {}
    print("| build | one at a time | 16 at once |\n|---|---|---|")
    for build in sys.argv[1:]:
        cells = []
        for at_once in (1, 16):
            cost = per_message(build, at_once)
            base = first.setdefault(at_once, cost)
            more = "" if cost == base else f" ({100 * (cost / base - 1):+.1f} %)"
            cells.append(f"{cost:,.0f}{more}")
        print(f"| {build} | {' | '.join(cells)} |", flush=True)
    return None


if __name__ == "__main__":
    main()
