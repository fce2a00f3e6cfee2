#!/usr/bin/python3
"""tools/field_results.py PRESET: writes what ctest has just run in the folder of a preset into
docs/field-results.md: for each file of tests its last run. A run of a part of a file keeps what had
failed in it before and did not run now. Called by tools/test --field.
"""
import collections
import datetime
import pathlib
import re
import subprocess
import sys

import test_results
from test_results import Result

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/field-results.md"
HEAD = "| tests | when | commit | passed | failed | skipped |\n|---|---|---|---|---|---|\n"
CELLS = re.compile(r" (?<!\\)\| ")
FAILED = re.compile("`([^`]+)`")


def group(name: str) -> str:
    """The file that a test is in: two words of "integration.doctor.a_robot_alone"."""
    return ".".join(name.split(".")[:2])


def cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def row(name: str, key: str, results: list[Result], there_are: int, before: str, when: str,
        commit: str) -> str:
    """One line of the table; `before` is the one that it takes the place of."""
    skipped = [each for each in results if each.came == "skipped"]
    reasons = ": " + "; ".join(sorted({cell(each.why) for each in skipped})) if skipped else ""
    passed = sum(each.came == "passed" for each in results)
    failed = [cell(each.name[len(name) + 1:] or name) for each in results
              if each.came in ("failed", "ended")]
    part = ""
    if len(results) < there_are:
        part = f" ({len(results)} of {there_are} ran)"
        now = {cell(each.name[len(name) + 1:] or name) for each in results}
        failed += [f"{each} (before)" for each in failed_in(before) if each not in now]
    names = f"{len(failed)}: " + ", ".join(
        f"`{each.removesuffix(' (before)')}`" + " (before)" * each.endswith(" (before)")
        for each in failed) if failed else "0"
    return (f"| `{cell(key)}` | {when} | {commit} | {passed}{part} | {names} "
            f"| {len(skipped)}{reasons} |\n")


def failed_in(line: str) -> list[str]:
    """The tests that failed by a line of the table, if there is one."""
    cells = CELLS.split(line.strip("| \n"))
    return FAILED.findall(cells[4]) if len(cells) == 6 else []


def merged(page: str, results: list[Result], there_are: collections.Counter, preset: str, when: str,
           commit: str) -> str:
    """The page with these results in the place of older ones of the same files."""
    if page.count(HEAD) != 1:
        sys.exit(f"tools/field_results.py: {PAGE.name} has no table as this writes it; take it "
                 f"back by: git checkout docs/{PAGE.name}")
    before, table = page.split(HEAD)
    rows = {line.split("|")[1].strip(" `"): line for line in table.splitlines(keepends=True)
            if line.startswith("| `")}
    by_file: dict[str, list[Result]] = {}
    for result in results:
        by_file.setdefault(group(result.name), []).append(result)
    for name, each in by_file.items():
        key = name if preset in ("test", "fuzz") else f"{name}, {preset}"
        rows[key] = row(name, key, each, there_are[name], rows.get(key, ""), when, commit)
    return before + HEAD + "".join(line for _, line in sorted(rows.items()))


def in_the_field(folder: pathlib.Path) -> collections.Counter:
    """How many tests of kind field each of pytest's files has."""
    return collections.Counter(
        group(line.split(" ", 2)[2]) for path in (folder / "pytest").glob("*.txt")
        for line in path.read_text().splitlines() if line.startswith("field "))


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
    PAGE.write_text(merged(PAGE.read_text(), test_results.read(folder),
                           in_the_field(folder), sys.argv[1],
                           datetime.date.today().isoformat(), commit_now()))


if __name__ == "__main__":
    main()
