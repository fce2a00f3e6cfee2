"""What each attack of a program on the robot came to before there was something against it, and
now: rows() gives (name, figure then, figure now). Run it to see them; needs root, to be another
user.

local_figures.py"""
import json
import subprocess
import sys
import time

from local_client import Client, Daemon, field, frame

GET_POSE, SENT = field(17, b""), 12


def begin(daemon, *words):
    """An attack that holds what it has. @return it, and what it printed"""
    attack = daemon.attack(*words, stdin=subprocess.PIPE)
    return attack, json.loads(attack.stdout.readline())


def places_without_a_process():
    with Daemon() as daemon:
        daemon.attack("doomed_sessions", 44).wait(60)
        time.sleep(2)
        held = daemon.status()["clients"] - 1
    return f"{held} of 44"


def room_for_others():
    with Daemon() as daemon:
        attack, taken = begin(daemon, "fill_shares", "waiting")
        other, answers = Client(daemon.socket), []
        other.take()
        publisher = other.advertise("other", queue=16)
        for number in range(1, 51):
            body = field(1, publisher) + field(2, number) + field(3, b"x")
            other.socket.sendall(frame(field(11, body)))
            answers.append(other.take())
        attack.communicate("")
    sent = sum(SENT in answer for answer in answers)
    return f"{sent} of 50 (the attacker has {taken['waiting']['given']})"


def wait_during_changes():
    """The longest wait of another client for its pose, and the log, during floods of changes."""
    names = "".join(f"channel{number} = {number}\n" for number in range(1024))
    with Daemon("[channels]\n" + names) as daemon:
        other, longest_s = Client(daemon.socket), 0.0
        other.take()
        attack = daemon.attack("flood_changes", 256, 100_000)
        while attack.poll() is None:
            began = time.perf_counter()
            other.ask(GET_POSE)
            longest_s = max(longest_s, time.perf_counter() - began)
            time.sleep(0.001)
        daemon.finish(attack)
        log_kib = daemon.log.stat().st_size // 1024
    return f"{longest_s * 1e3:.0f} ms; {log_kib} KiB"


def places_of_operators():
    with Daemon() as daemon:
        attack, taken = begin(daemon, "fill_shares", "channels", "places")
        answered = daemon.cli("status").returncode == 0
        attack.communicate("")
    places = taken["places"]["given"] + len(taken["channels"]["given"])
    return f"{places} and {sum(taken['channels']['given'])}; {'yes' if answered else 'no'}"


# What is measured, what it was in the reference, and how it is measured now.
FIGURES = {
    "places": ("places held 2 s after kill -9 by connections without a process", "64 of 64",
               places_without_a_process),
    "waiting": ("messages of others that leave while one user's wait for their copies", "0 of 50",
                room_for_others),
    "changes": ("longest wait of others during 256 reloads in one write and 100,000 node ids; "
                "the log", "4,100 ms; 122 MB in 4 s", wait_during_changes),
    "shares": ("places and channels that one user takes; whether status is answered",
               "64 and 64; no", places_of_operators),
}


def rows():
    for title, reference, measure in FIGURES.values():
        yield title, reference, measure()


if __name__ == "__main__":
    for name, then, now in rows():
        print(f"{name}\n  then {then}\n  now  {now}", flush=True)
    sys.exit(0)
