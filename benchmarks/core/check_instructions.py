#!/usr/bin/env python3
"""Holds the instructions per received packet against a budget.

usage: check_instructions.py core_receive_cost BUDGET.json COMPILER_VERSION

Callgrind's counts repeat exactly for one compiler; the budget names the major version of g++ that
it was measured with, and with another one only the ratios are held.
"""

import json
import sys

from core_table import QUICK, measured


def main() -> int:
    program, budget_path, compiler = sys.argv[1:4]
    with open(budget_path, encoding="utf-8") as file:
        budget = json.load(file)
    names = set(budget["instructions"]) | set(budget["most_times"])
    names |= {base for base, _ in budget["most_times"].values()}
    cost = {name: each for name, each, _ in measured(program, sorted(names), *QUICK)}
    failed = False
    factor = 1 + budget["tolerance_percent"] / 100
    for name, limit in budget["instructions"].items():
        print(f"{name}: {cost[name]:.1f} instructions per packet, budget {limit}")
        if cost[name] > limit * factor and compiler.split(".")[0] == budget["compiler"]:
            print(f"  more than {budget['tolerance_percent']} % above its budget")
            failed = True
    for name, (base, most) in budget["most_times"].items():
        ratio = cost[name] / cost[base]
        print(f"{name}: {ratio:.2f} times {base}, at most {most}")
        failed = failed or ratio > most
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
