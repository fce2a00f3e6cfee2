"""Holds the kinds of tests: for tools/check.

Collects each folder that a swarmtalk_pytest gives a kind, with tests/support/kinds.py, which finds
tests of kind `logic` that do what such a test may not; looks for sleep in the bodies of GoogleTests
of that kind; and counts those of kind `clock`, one for each parameter.
"""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
MOST_CLOCK = 60  # it may fall only
FOLDER = re.compile(r"^ *swarmtalk_pytest\((\w+) (\w+)", re.MULTILINE)
PROGRAM = re.compile(r"^swarmtalk_test\(([^)]*)\)", re.MULTILINE)
TEST = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\(\s*(\w+),\s*(\w+)\) \{(.*?)^\}",
                  re.MULTILINE | re.DOTALL)
SLEEP = re.compile(r"(?<![.>\w])(?:sleep_for|sleep_until|u?sleep|nanosleep)\([^)]")


def collect(folder: pathlib.Path, prefix: str, kind: str) -> tuple[list[str], str]:
    """The list of a folder's tests as kinds.py writes it, and what went wrong."""
    with tempfile.TemporaryDirectory() as made:
        into = pathlib.Path(made) / "list"
        done = subprocess.run(
            ["/usr/bin/python3", "-B", ROOT / "tests/support/kinds.py", "collect", prefix, kind,
             into], cwd=folder, capture_output=True, text=True, timeout=120, check=False,
            env=os.environ | {"SWARMTALK_BUILD": str(ROOT / "build-test"),
                              "PYTHONDONTWRITEBYTECODE": "1"})
        if done.returncode != 0:
            return [], f"{folder.relative_to(ROOT)}: pytest cannot collect it:\n{done.stderr}"
        return into.read_text().splitlines(), ""


def in_cpp(lists: pathlib.Path) -> tuple[int, list[str]]:
    """How many tests the programs of a CMakeLists.txt leave out of kind `logic`, and what is wrong
    with the others: a test of that kind does not sleep."""
    count, problems = 0, []
    for program in PROGRAM.findall(lists.read_text()):
        words = program.split()
        filters = words[words.index("CLOCK") + 1:] if "CLOCK" in words else []
        clock = re.compile("|".join(word.replace(".", r"\.").replace("*", ".*")
                                    for word in filters) or "(?!)")
        for word in words:
            if not word.endswith("_test.cpp"):
                continue
            for suite, name, body in TEST.findall((lists.parent / word).read_text()):
                if clock.fullmatch(f"{suite}.{name}"):
                    count += 1
                elif SLEEP.search(body):
                    problems.append(f"not logic: {suite}.{name} sleeps")
    return count, problems


def main():
    clock, problems, jobs = 0, [], []
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as workers:
        for lists in sorted((ROOT / "tests").glob("**/CMakeLists.txt")):
            count, found = in_cpp(lists)
            clock += count
            problems += found
            for name, kind in FOLDER.findall(lists.read_text()):
                if kind not in ("logic", "clock", "field"):
                    problems.append(f"{name}: '{kind}' is no kind; say logic, clock or field")
                elif name != "argos":  # collected where ARGoS is installed only
                    jobs.append(workers.submit(collect, lists.parent, name, kind))
        for job in jobs:
            tests, problem = job.result()
            clock += sum(line.startswith("clock ") for line in tests)
            problems += [problem] if problem else []
            problems += [line for line in tests if line.startswith("not ")]
    if clock > MOST_CLOCK:
        problems.append(f"{clock} tests are of kind clock, and {MOST_CLOCK} may be: see "
                        "CONTRIBUTING.md for what makes a test one of kind logic")
    for problem in problems:
        print(problem, file=sys.stderr)
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
