#!/usr/bin/python3
"""Lines of each class with all its methods, wherever they stand. Outside of core none may have more
than 400.

usage: tools/check_classes.py [--most N]    prints the N largest as well

A class is what begins and ends in the first column, as clang-format leaves it; its methods are the
definitions Class::method in the sources of its folder. Comments before a definition count.
"""
import argparse
import collections
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
LIMIT = 400
CLASS = re.compile(r"(?:template .*?> )?(?:class|struct) (?:\[\[\w+\]\] )?(\w+)")
METHOD = re.compile(r"\b(\w+)(?:<[\w, .]*>)?::(?:[\w<>]+::)*(?:~?\w+|operator\W+) ?\(")
COMMENT = re.compile(r"//|template\b|/\*| \*")


def name_of(head: str):
    """Whose definition begins so; None: no class's."""
    found = CLASS.match(head)
    if found:
        return found[1]
    before_body = head.split(" : ")[0] if not head.startswith("class") else head
    found = METHOD.search(before_body)
    return found[1] if found else None


def definitions(lines):
    """(name, number of lines) of each definition in the first column that is of a class."""
    start = comment = None
    for number, line in enumerate(lines):
        if start is None:
            if COMMENT.match(line):
                comment = number if comment is None else comment
                continue
            if re.match(r"(?!namespace|using|extern)[A-Za-z_\[~]", line):
                start = number
            elif not line.strip():
                comment = None
                continue
            else:
                comment = None
                continue
        ends_here = line.startswith("}") or re.search(r"(;|[{].*[}])$", line)
        if line.startswith((" ", ")")) and not line.startswith("}"):
            ends_here = line.endswith(";") and not any(
                each.endswith("{") for each in lines[start:number + 1])
        if ends_here:
            head = " ".join(each.strip() for each in lines[start:number + 1]).split("{")[0]
            if "{" in " ".join(lines[start:number + 1]):
                name = name_of(head)
                if name:
                    yield name, number - (start if comment is None else comment) + 1
            start = comment = None


def measured():
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "*.hpp", "*.cpp", "*.h"],
        cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    sizes = collections.Counter()
    for path in map(pathlib.Path, sorted(set(listed))):
        if path.parts[0] == "core" or not (ROOT / path).exists():
            continue
        for name, count in definitions((ROOT / path).read_text(encoding="utf-8").splitlines()):
            sizes[str(path.parent), name] += count
    return sizes


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--most", type=int, default=0)
    sizes = measured().most_common()
    for (folder, name), count in sizes[:parser.parse_args().most]:
        print(f"{count:5} {folder}: {name}")
    large = [each for each in sizes if each[1] > LIMIT]
    for (folder, name), count in large:
        print(f"{folder}: class {name} has {count} lines with its methods, more than {LIMIT}; "
              "give a part of it a class of its own")
    return 1 if large else 0


if __name__ == "__main__":
    sys.exit(main())
