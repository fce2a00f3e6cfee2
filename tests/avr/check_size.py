#!/usr/bin/env python3
"""Holds the size of the library on AVR against a budget.

usage: check_size.py FOLDER_WITH_IMAGES BUDGET.json

RAM is the size of the node (channels, buffers, caches, counters) in the follower.

Flash is counted in two ways. `library_flash_bytes` is the library by symbol: all functions of
swarmtalk::core in the follower, what is inlined in them included, and the static constructor. Apart
are `main`, the program (suite), the robot, and the C library and libgcc; the figure of the
implementation of 2020 is taken likewise. `flash_added_bytes` is all that the follower has more than
the same image without library and program, by avr-size: so nothing can hide in another symbol.
"""

import json
import re
import subprocess
import sys


def sections(image: str) -> tuple[int, int]:
    """Flash and RAM of an image in bytes, by avr-size."""
    line = subprocess.run(["avr-size", image], check=True, capture_output=True, text=True)
    text, data, bss = (int(word) for word in line.stdout.splitlines()[1].split()[:3])
    return text + data, data + bss


def symbol_size(image: str, name: str) -> int:
    """Bytes of the largest symbol whose name contains `name`."""
    symbols = subprocess.run(["avr-nm", "-CS", image], check=True, capture_output=True, text=True)
    sizes = [int(line.split()[1], 16) for line in symbols.stdout.splitlines()
             if name in line and len(line.split()) >= 4]
    return max(sizes)


def library_flash(image: str) -> int:
    """Bytes of the library's functions and of the static constructor."""
    symbols = subprocess.run(["avr-nm", "-CS", image], check=True, capture_output=True, text=True)
    total = 0
    for line in symbols.stdout.splitlines():
        row = re.match(r"[0-9a-f]+ ([0-9a-f]+) [tTwW] (.*)", line)
        # Some names begin with the type that the function returns.
        if row and re.match(r"(\w+ )*swarmtalk::core::|_GLOBAL__sub_I_", row.group(2)):
            total += int(row.group(1), 16)
    if total == 0:
        raise ValueError(f"{image} has no function of swarmtalk::core: were its symbols stripped?")
    return total


def main() -> int:
    folder, budget_path = sys.argv[1:3]
    with open(budget_path, encoding="utf-8") as file:
        budget = json.load(file)
    follower_flash, _ = sections(f"{folder}/follower.elf")
    blank_flash, _ = sections(f"{folder}/blank.elf")
    measured = {
        "node_ram_bytes": symbol_size(f"{folder}/follower.elf", "robot"),
        "library_flash_bytes": library_flash(f"{folder}/follower.elf"),
        "flash_added_bytes": follower_flash - blank_flash,
    }
    is_within = True
    for name, size in measured.items():
        over = size > budget[name]
        is_within = is_within and not over
        print(f"{name}: {size} of {budget[name]}{'  OVER BUDGET' if over else ''}")
    return 0 if is_within else 1


if __name__ == "__main__":
    sys.exit(main())
