#!/usr/bin/env python3
"""Prints the tables of the protocol library: instructions per packet, swarms, AVR size and cycles.

usage: core_table.py BUILD_FOLDER      (built with -DSWARMTALK_TESTS=ON -DSWARMTALK_BENCHMARKS=ON)

Instructions are counted by callgrind, as the difference of two run lengths divided by the packets
between them, so that starting up and preparing packets cancel out.
"""

import re
import subprocess
import sys

SHORT, LONG = 8000, 24000
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
}


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


def print_instructions(program: str) -> None:
    print("### Instructions per packet (9-byte packets, sum-8, -O2)\n")
    print("| what | instructions | messages delivered per packet |\n|---|---|---|")
    for situation, what in SITUATIONS.items():
        cost = (instructions(program, situation, LONG)
                - instructions(program, situation, SHORT)) / (LONG - SHORT)
        share = (delivered(program, situation, LONG)
                 - delivered(program, situation, SHORT)) / (LONG - SHORT)
        print(f"| {what} | {cost:.0f} | {share:.3f} |", flush=True)


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
    subprocess.run([f"{build}/benchmarks/core/core_swarm_table"], check=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
