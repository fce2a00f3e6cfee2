#!/usr/bin/env python3
"""Prints the tables of the protocol library: instructions per packet, swarms, AVR size and cycles.

usage: core_table.py BUILD_FOLDER      (built with -DSWARMTALK_TESTS=ON -DSWARMTALK_BENCHMARKS=ON)
       core_table.py --quick PROGRAM [WORD...]   instructions of a core_receive_cost alone, of the
                                                 situations with one of the words in their names

Instructions are counted by callgrind, as the difference of two run lengths divided by the packets
between them, so that starting up and preparing packets cancel out.
"""

import concurrent.futures
import re
import subprocess
import sys

SHORT, LONG = 8000, 24000
QUICK = 1600, 8000
JOBS = 2
SITUATIONS = {
    "idle": "pull, nothing waits (Kilobot profile)",
    "send1": "send and pull a message of 1 packet (Kilobot)",
    "send8": "send and pull, per packet of 8 (Kilobot)",
    "kilobot1": "receive and deliver 1 packet (Kilobot, scans 20 records)",
    "kilobot8": "receive, per packet of 8 (Kilobot)",
    "single": "receive and deliver 1 packet (memory for all)",
    "eight": "receive, per packet of 8 (memory for all)",
    "senders2": "8-packet messages of 2 interleaved senders, per packet",
    "senders100": "8-packet messages of 100 interleaved senders, per packet",
    "full3000": "receive and deliver 1 packet, 3000 fragments held",
    "reverse8": "receive, per packet of 8 that come last one first (memory for all)",
    "kilobot_reverse8": "receive, per packet of 8 that come last one first (Kilobot)",
    "flood1": "receive, deliver and send on a flood of 1 packet (memory for all)",
    "flood20": "the same, of 20 senders in turn (memory for all)",
    "kilobot_flood1": "receive, deliver and send on a flood of 1 packet (Kilobot)",
    "kilobot_flood20": "the same, of 20 senders in turn (Kilobot)",
    "again": "receive a neighbour's copy of a flood that was sent on (memory for all)",
    "again_waiting": "receive a neighbour's copy of a flood that waits (memory for all)",
    "kilobot_again": "receive a neighbour's copy of a flood that was sent on (Kilobot)",
    "kilobot_again_waiting": "receive a neighbour's copy of a flood that waits (Kilobot)",
    "own_flood1": "send and pull one's own flood of 1 packet (memory for all)",
    "own_flood8": "send and pull one's own flood, per packet of 8 (memory for all)",
    "kilobot_own_flood1": "send and pull one's own flood of 1 packet (Kilobot)",
    "kilobot_own_flood8": "send and pull one's own flood, per packet of 8 (Kilobot)",
    "own_echo": "receive one's own flood from a neighbour (memory for all)",
    "kilobot_own_echo": "receive one's own flood from a neighbour (Kilobot)",
    "wifi_calm": "wifi profile, receive and deliver 1 packet, 600 records alive",
    "wifi_full": "the same, 100 senders, 100 messages/s: a full table",
    "wifi_fast": "the same, one sender, 5000 messages/s: a full table",
    "wifi_calm_flood": "wifi profile, receive, deliver and send on a flood, 600 records alive",
    "wifi_full_flood": "the same, 100 senders, 100 messages/s: a full table",
    "wifi_fast_flood": "the same, one sender, 5000 messages/s: a full table",
    "wifi_chosen": "wifi profile, 1 packet of an attacker after 4096, worst of all attacks",
    "wifi_chosen_flood": "the same, flooded",
}
# Attackers' ways to choose their messages' names (chosen_keys.hpp), and with two seeds where the
# node's secret may be drawn unluckily. What is printed for the whole is the worst of them.
ATTACKS = ["old", "nodes", "numbers", "far_numbers", "epochs", "nodes_epochs", "step", "step:2"]
WORST_OF = {group: [f"{group}_{attack}" for attack in ATTACKS]
            for group in ("wifi_chosen", "wifi_chosen_flood")}


def instructions(program: str, situation: str, packets: int) -> int:
    """Instructions of one run, by callgrind."""
    run = subprocess.run(
        ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", program, situation,
         str(packets)], check=True, capture_output=True, text=True)
    return int(re.search(r"Collected : (\d+)", run.stderr).group(1))


def delivered(program: str, situation: str, packets: int) -> int:
    run = subprocess.run([program, situation, str(packets)], check=True, capture_output=True,
                         text=True)
    return int(run.stdout)


def per_packet(program: str, situation: str, short: int, long: int) -> tuple[float, float]:
    """Instructions, and messages delivered."""
    cost, share = (count(program, situation, long) - count(program, situation, short)
                   for count in (instructions, delivered))
    return cost / (long - short), share / (long - short)


def measured(program: str, situations: list[str], short: int, long: int):
    """Name, instructions and deliveries of each situation, in order, as soon as they are known."""
    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
        rows = {name: [pool.submit(per_packet, program, part, short, long)
                       for part in WORST_OF.get(name, [name])] for name in situations}
        for name in situations:
            yield name, *max(row.result() for row in rows[name])


def print_instructions(program: str) -> None:
    print("### Instructions per packet (9 bytes, sum-8; wifi: 64 bytes of payload; -O2)\n")
    print("| what | instructions | messages delivered per packet |\n|---|---|---|")
    for name, cost, share in measured(program, list(SITUATIONS), SHORT, LONG):
        print(f"| {SITUATIONS[name]} | {cost:.0f} | {share:.3f} |", flush=True)


def print_quickly(program: str, words: list[str]) -> None:
    every = [part for name in SITUATIONS for part in WORST_OF.get(name, [name])]
    chosen = [name for name in every if not words or any(word in name for word in words)]
    for name, cost, share in measured(program, chosen, *QUICK):
        print(f"{name:28} {cost:9.1f}   delivered {share:.3f}", flush=True)


def main() -> int:
    if sys.argv[1] == "--quick":
        print_quickly(sys.argv[2], sys.argv[3:])
        return 0
    build = sys.argv[1]
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], check=False,
                            capture_output=True, text=True).stdout.strip()
    print(f"Commit {commit}. Command: benchmarks/core/core_table.py {build}\n")
    print_instructions(f"{build}/benchmarks/core/core_receive_cost")
    print("\n### AVR (ATmega328P, flags of cmake/AvrFlags.cmake)\n\n```", flush=True)
    for name in ("avr.size", "avr.cycles"):
        run = subprocess.run(["ctest", "-R", name, "-V"], cwd=build, check=False,
                             capture_output=True, text=True)
        lines = re.findall(r"^\d+: ( *\d+ cycles.*|\w+_bytes: .*)$", run.stdout, re.M)
        print("\n".join(lines))
    print("```", flush=True)
    for table in ("swarm", "flood", "mishap"):
        subprocess.run([f"{build}/benchmarks/core/core_{table}_table"], check=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
