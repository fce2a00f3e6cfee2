#!/usr/bin/python3
"""What hostile neighbours do to robots: today's figures beside those of the reference.

Each file in benchmarks/hostile/ is one attack:
    TITLE      what is attacked, a line
    REFERENCE  what was measured before it was repaired, a line
    measure()  runs it against the daemons of build-test (SWARMTALK_BUILD), returns a line
Needs root. Usage: benchmarks/hostile.py [NAME ...]
"""
import importlib.util
import os
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
TESTS = HERE.parent / "tests"
sys.path[:0] = [str(TESTS / part) for part in ("support", "integration", "hostile/attacks")]
os.environ.setdefault("SWARMTALK_SEED", "1")


def load(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def main():
    attacks = {path.stem: load(path) for path in sorted((HERE / "hostile").glob("*.py"))}
    wanted = sys.argv[1:] or attacks
    unknown = sorted(set(wanted) - set(attacks))
    if unknown:
        sys.exit(f"benchmarks/hostile.py: no {', '.join(unknown)}; there are {', '.join(attacks)}")
    if os.geteuid() != 0:
        sys.exit("benchmarks/hostile.py: network namespaces need root; run it with sudo")
    print("| attack | reference | today |\n|---|---|---|", flush=True)
    for name in wanted:
        module = attacks[name]
        print(f"| {module.TITLE} | {module.REFERENCE} | {module.measure()} |", flush=True)


main()
