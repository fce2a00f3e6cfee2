#!/usr/bin/env python3
"""Holds what a received packet costs where much is remembered, or where names were chosen to meet,
against what it costs elsewhere.

usage: check_instructions.py core_receive_cost LIMITS.json COMPILER_VERSION
"""

import json
import sys

from core_table import measured


def main() -> int:
    program, limits_path = sys.argv[1:3]
    with open(limits_path, encoding="utf-8") as file:
        most_times = json.load(file)["most_times"]
    names = set(most_times) | {base for base, _ in most_times.values()}
    cost = dict(measured(program, sorted(names)))
    failed = False
    for name, (base, most) in most_times.items():
        ratio = cost[name] / cost[base]
        print(f"{name}: {cost[name]:.1f} instructions per packet, {ratio:.2f} times {base}, "
              f"at most {most}")
        failed = failed or ratio > most
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
