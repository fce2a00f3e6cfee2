#!/usr/bin/python3
"""Checks every #include of ours against the table in docs/architecture.md, and core's headers.

A row names a folder, or a room in one ("daemon/hub"). A file belongs to the longest row that its
path begins with, and a name in the right column means the files of that row: rooms of a folder are
named each. The rows must not form a circle."""
import graphlib
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
SUFFIXES = {".hpp", ".cpp", ".h", ".c"}
CORE_HEADERS = {"stdint.h", "stddef.h", "string.h"}
# Folders that hold public headers under swarmtalk/: an include of "swarmtalk/x" is theirs.
PUBLIC = {"core": ROOT / "core/include", "client_lib": ROOT / "client_lib/include"}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def read_table():
    """Returns {folder: set of folders it may include}; '*' means any."""
    text = (ROOT / "docs/architecture.md").read_text()
    table = re.search(r"<!-- include-table -->(.*?)<!-- end -->", text, re.S)
    if not table:
        sys.exit("check_includes: docs/architecture.md has no include table")
    allowed = {}
    for line in table.group(1).splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) == 2 and re.fullmatch(r"[a-z0-9_/]+", cells[0]) and cells[0] != "folder":
            allowed[cells[0]] = {name.strip() for name in cells[1].split(",") if name.strip()}
    return allowed


def within(name, folder):
    """Whether a path or a folder's name lies in a folder, or is it."""
    return name == folder or name.startswith(folder + "/")


def row_of(name, allowed):
    """The row that a path from the root belongs to, or None."""
    return max((row for row in allowed if within(name, row)), key=len, default=None)


def table_problems(allowed):
    """Rows of folders that are not there, folders beside rooms that have no row, and circles."""
    for row, may in allowed.items():
        for name in {row} | (may - {"*"}):
            if not (ROOT / name).is_dir() or row_of(name, allowed) != name:
                yield f"the table names {name}: no such folder, or it has no row"
    parents = {row.rsplit("/", 1)[0] for row in allowed if "/" in row}
    for parent in sorted(parents):
        for path in sorted((ROOT / parent).iterdir()):
            name = path.relative_to(ROOT).as_posix()
            if path.is_dir() and row_of(name, allowed) == parent and holds_sources(path):
                yield f"{name} lies beside rooms and has no row of its own"
    try:
        graphlib.TopologicalSorter({row: may - {"*"} for row, may in allowed.items()}).prepare()
    except graphlib.CycleError as circle:
        yield "the table has a circle: " + " <- ".join(circle.args[1])


def holds_sources(folder):
    return any(path.suffix in SUFFIXES for path in folder.rglob("*"))


def target_row(path, name, allowed):
    """The row of ours that an include names, or None for a system or third-party header."""
    if "/" in name and name.split("/")[0] in {row.split("/")[0] for row in allowed}:
        return row_of(name, allowed)
    if name.split("/")[0] == "swarmtalk":
        for folder, include_dir in PUBLIC.items():
            if (include_dir / name).exists():
                return folder
    if (path.parent / name).exists():
        return row_of((path.parent / name).resolve().relative_to(ROOT).as_posix(), allowed)
    return None


def include_problems(path, allowed):
    row = row_of(path.relative_to(ROOT).as_posix(), allowed)
    may = allowed[row]
    for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        kind, name = match.groups()
        where = f"{path.relative_to(ROOT)}:{number}"
        target = target_row(path, name, allowed)
        if target and target != row and "*" not in may and target not in may:
            yield f"{where}: {row} may not include {target} ({name})"
        if row == "core" and kind == "<" and name not in CORE_HEADERS:
            yield f"{where}: core may not include <{name}>"


def main():
    allowed = read_table()
    problems = list(table_problems(allowed))
    for folder in sorted({row.split("/")[0] for row in allowed}):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in SUFFIXES and path.is_file() and row_of(
                    path.relative_to(ROOT).as_posix(), allowed):
                problems += include_problems(path, allowed)
    for problem in problems:
        print(problem)
    if problems:
        sys.exit("check_includes: see the table in docs/architecture.md")


if __name__ == "__main__":
    main()
