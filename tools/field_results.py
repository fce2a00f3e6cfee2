#!/usr/bin/python3
"""tools/field_results.py PRESET: writes what ctest has just run in the folder of a preset into
docs/field-results.md: for each file of tests its last run. Called by tools/test --field.
"""
import collections
import datetime
import json
import pathlib
import re
import subprocess
import sys
import typing
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/field-results.md"
HEAD = "| tests | when | commit | passed | failed | skipped |\n|---|---|---|---|---|---|\n"
REASON = re.compile(r"^SKIPPED \[\d+\] [^ ]+ (.*)$", re.MULTILINE)
SKIPPED = re.compile(r"^skipped: (.*)$|: Skipped\n(.*)$", re.MULTILINE)


class Result(typing.NamedTuple):
    """Of one test: "passed", "failed" or "skipped", and why the last."""
    name: str
    came: str
    why: str = ""


def read(path: pathlib.Path) -> list[Result]:
    """The results in a JUnit file as ctest writes it."""
    found = []
    for case in xml.etree.ElementTree.parse(path).getroot().iter("testcase"):
        output = case.findtext("system-out") or ""
        reason = REASON.search(output) or SKIPPED.search(output)
        skipped = case.find("skipped")
        if case.get("status") == "run":
            found.append(Result(case.get("name"), "passed"))
        elif skipped is not None and "SKIP" in skipped.get("message", ""):
            why = next(filter(None, reason.groups()), "") if reason else "without a reason"
            found.append(Result(case.get("name"), "skipped", why))
        else:  # also one whose program is missing
            found.append(Result(case.get("name"), "failed"))
    return found


def group(name: str) -> str:
    """The file that a test is in: two words of "integration.doctor.a_robot_alone"."""
    return ".".join(name.split(".")[:2])


def cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def row(name: str, results: list[Result], there_are: int, when: str, commit: str) -> str:
    """One line of the table."""
    def named(came):
        each = [result.name[len(name) + 1:] or name for result in results if result.came == came]
        return f"{len(each)}: " + ", ".join(f"`{cell(test)}`" for test in each) if each else "0"
    skipped = [result for result in results if result.came == "skipped"]
    reasons = ": " + "; ".join(sorted({cell(result.why) for result in skipped})) if skipped else ""
    passed = sum(result.came == "passed" for result in results)
    part = f" ({len(results)} of {there_are} ran)" if len(results) < there_are else ""
    return (f"| `{cell(name)}` | {when} | {commit} | {passed}{part} | {named('failed')} "
            f"| {len(skipped)}{reasons} |\n")


def merged(page: str, results: list[Result], there_are: collections.Counter, preset: str, when: str,
           commit: str) -> str:
    """The page with these results in the place of older ones of the same files."""
    before, table = page.split(HEAD)
    rows = {line.split("|")[1].strip(" `"): line for line in table.splitlines(keepends=True)}
    by_file: dict[str, list[Result]] = {}
    for result in results:
        by_file.setdefault(group(result.name), []).append(result)
    for name, each in by_file.items():
        key = name if preset in ("test", "fuzz") else f"{name}, {preset}"
        rows[key] = row(name, each, there_are[name], when, commit).replace(
            f"`{cell(name)}`", f"`{cell(key)}`", 1)
    return before + HEAD + "".join(line for _, line in sorted(rows.items()))


def in_the_field(folder: pathlib.Path) -> collections.Counter:
    """How many tests of kind field each file has."""
    done = subprocess.run(["ctest", "--test-dir", folder, "-L", "^field$", "--show-only=json-v1"],
                          capture_output=True, text=True, check=True)
    return collections.Counter(group(test["name"]) for test in json.loads(done.stdout)["tests"])


def commit_now() -> str:
    def git(*words):
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True,
                              check=False).stdout.strip()
    changed = git("status", "--porcelain", "--", ".", f":!{PAGE.relative_to(ROOT)}")
    return (git("rev-parse", "--short", "HEAD") or "unknown") + (", changed" if changed else "")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = ROOT / f"build-{sys.argv[1]}"
    PAGE.write_text(merged(PAGE.read_text(), read(folder / "Testing/results.xml"),
                           in_the_field(folder), sys.argv[1],
                           datetime.date.today().isoformat(), commit_now()))


if __name__ == "__main__":
    main()
