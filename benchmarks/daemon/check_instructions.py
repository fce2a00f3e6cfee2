#!/usr/bin/env python3
"""Holds the instructions of a message through two daemons against a budget.

usage: check_instructions.py daemon_through_two BUDGET.json COMPILER_VERSION

The programs' ends are not counted but for writing and reading bytes, nor is the kernel. Callgrind's
counts repeat within a few instructions for one compiler. The budget names the major version of g++
that it was measured with; another one may need half as much again.
"""

import json
import re
import subprocess
import sys

LENGTHS = (2000, 6000)
TIMEOUT_S = 250
OTHER_COMPILER_FACTOR = 1.5


def instructions(program: str, messages: int) -> int:
    """Of a whole run."""
    done = subprocess.run(
        ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", program, str(messages)],
        capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    if done.returncode != 0 or int(done.stdout) != messages:
        sys.exit(f"{program} {messages}: {done.stdout}{done.stderr}")
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def per_message(program: str) -> float:
    short, long = (instructions(program, length) for length in LENGTHS)
    return (long - short) / (LENGTHS[1] - LENGTHS[0])


def main() -> int:
    program, budget_path, compiler = sys.argv[1:4]
    with open(budget_path, encoding="utf-8") as file:
        budget = json.load(file)
    factor = 1 + budget["tolerance_percent"] / 100
    if compiler.split(".")[0] != budget["compiler"]:
        factor = OTHER_COMPILER_FACTOR
    cost = per_message(program)
    print(f"{cost:.0f} instructions per message, budget {budget['per_message']}, "
          f"at most {budget['per_message'] * factor:.0f}")
    return 1 if cost > budget["per_message"] * factor else 0


if __name__ == "__main__":
    sys.exit(main())
