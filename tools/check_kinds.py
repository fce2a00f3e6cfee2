"""Holds the kinds of tests: for tools/check.

Collects each folder that a swarmtalk_pytest gives a kind, with tests/support/kinds.py, which finds
tests of kind `logic` that do what such a test may not; and counts those of kind `clock`, one for
each parameter.
"""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
MOST_CLOCK = 410  # today's; it may fall only
FOLDER = re.compile(r"^ *swarmtalk_pytest\((\w+) (\w+)", re.MULTILINE)
PROGRAM = re.compile(r"^swarmtalk_test\(([^)]*)\)", re.MULTILINE)
TEST = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\(\s*(\w+),\s*(\w+)\)", re.MULTILINE)


def collect(folder: pathlib.Path, kind: str) -> tuple[str, str]:
    """What the plugin prints of a folder, and what went wrong."""
    environment = os.environ | {
        "SWARMTALK_COLLECTING": "1", "SWARMTALK_KIND": kind, "PYTHONDONTWRITEBYTECODE": "1",
        "SWARMTALK_BUILD": str(ROOT / "build-test"), "PYTHONPATH": str(ROOT / "tests/support")}
    done = subprocess.run(
        ["/usr/bin/python3", "-m", "pytest", "-qq", "-s", "--collect-only", "-p",
         "no:cacheprovider", "-p", "kinds", "."], cwd=folder, env=environment, capture_output=True,
        text=True, timeout=120, check=False)
    if done.returncode != 0:
        return "", f"{folder.relative_to(ROOT)}: pytest cannot collect it:\n{done.stdout[-1000:]}"
    return done.stdout, ""


def clock_in_cpp(lists: pathlib.Path) -> int:
    """How many tests the programs of a CMakeLists.txt leave out of kind `logic`."""
    count = 0
    for program in PROGRAM.findall(lists.read_text()):
        words = program.split()
        if "CLOCK" not in words:
            continue
        filters = "|".join(word.replace(".", r"\.").replace("*", ".*")
                           for word in words[words.index("CLOCK") + 1:])
        for word in words:
            if word.endswith("_test.cpp"):
                count += sum(re.fullmatch(filters, f"{suite}.{name}") is not None
                             for suite, name in TEST.findall((lists.parent / word).read_text()))
    return count


def main():
    clock, problems, jobs = 0, [], []
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as workers:
        for lists in sorted((ROOT / "tests").glob("**/CMakeLists.txt")):
            clock += clock_in_cpp(lists)
            for name, kind in FOLDER.findall(lists.read_text()):
                if kind not in ("logic", "clock", "field"):
                    problems.append(f"{name}: '{kind}' is no kind; say logic, clock or field")
                elif name != "argos":  # collected where ARGoS is installed only
                    jobs.append(workers.submit(collect, lists.parent, kind))
        for job in jobs:
            printed, problem = job.result()
            clock += len(re.findall("^clock: ", printed, re.MULTILINE))
            problems += [problem] if problem else []
            problems += re.findall("^not .*", printed, re.MULTILINE)
    if clock > MOST_CLOCK:
        problems.append(f"{clock} tests are of kind clock, and {MOST_CLOCK} may be: see "
                        "CONTRIBUTING.md for what makes a test one of kind logic")
    for problem in problems:
        print(problem, file=sys.stderr)
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
