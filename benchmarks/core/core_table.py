#!/usr/bin/env python3
"""Prints the tables of the protocol library: instructions per packet, swarms, AVR size and cycles.

usage: core_table.py BUILD_FOLDER      (built with -DSWARMTALK_TESTS=ON -DSWARMTALK_BENCHMARKS=ON)

Instructions are counted by callgrind, as the difference of two run lengths divided by the packets
between them, so that starting up and preparing packets cancel out.
"""

import concurrent.futures
import re
import subprocess
import sys

SHORT, LONG = 1600, 8000
JOBS = 2
SITUATIONS = {
    "single": "receive and deliver 1 packet (9 bytes, sum-8, memory for all)",
    "full3000": "the same, 3000 fragments held",
    "senders2": "8-packet messages of 2 interleaved senders, per packet",
    "senders100": "8-packet messages of 100 interleaved senders, per packet",
    "wifi_full": "wifi profile, 64 bytes, 100 senders, 100 messages/s: a full table",
    "wifi_full_flood": "the same, flooded and sent on",
    "wifi_chosen": "wifi profile, 1 packet of an attacker after 4096, worst of all attacks",
    "wifi_chosen_flood": "the same, on a channel of floods",
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


def per_packet(program: str, situation: str) -> float:
    cost = instructions(program, situation, LONG) - instructions(program, situation, SHORT)
    return cost / (LONG - SHORT)


def measured(program: str, situations: list[str]):
    """Name and instructions of each situation, in order, as soon as they are known."""
    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
        rows = {name: [pool.submit(per_packet, program, part)
                       for part in WORST_OF.get(name, [name])] for name in situations}
        for name in situations:
            yield name, max(row.result() for row in rows[name])


def print_instructions(program: str) -> None:
    print("### Instructions per packet (-O2)\n\n| what | instructions |\n|---|---|")
    for name, cost in measured(program, list(SITUATIONS)):
        print(f"| {SITUATIONS[name]} | {cost:.0f} |", flush=True)


def main() -> int:
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
