#!/usr/bin/env python3
"""Holds the size of the library on AVR against a budget.

usage: check_size.py FOLDER_WITH_IMAGES BUDGET.json

RAM is the size of the node (channels, buffers, caches, counters) in the follower. Flash is
what the follower has more than the same image without library and program: library, program and the
runtime functions they pull in.
"""

import json
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


def main() -> int:
    folder, budget_path = sys.argv[1:3]
    with open(budget_path, encoding="utf-8") as file:
        budget = json.load(file)
    follower_flash, _ = sections(f"{folder}/follower.elf")
    blank_flash, _ = sections(f"{folder}/blank.elf")
    measured = {
        "node_ram_bytes": symbol_size(f"{folder}/follower.elf", "robot"),
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
