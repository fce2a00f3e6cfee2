#!/usr/bin/python3
"""Checks every #include of ours against the table in docs/architecture.md, and core's headers."""
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
        if len(cells) == 2 and re.fullmatch(r"[a-z_]+", cells[0]) and cells[0] != "folder":
            allowed[cells[0]] = {name.strip() for name in cells[1].split(",") if name.strip()}
    return allowed


def target_folder(path, name, allowed):
    """The folder of ours that an include names, or None for a system or third-party header."""
    first = name.split("/")[0]
    if first in allowed and "/" in name:
        return first
    if first == "swarmtalk":
        for folder, include_dir in PUBLIC.items():
            if (include_dir / name).exists():
                return folder
    if (path.parent / name).exists():
        return path.relative_to(ROOT).parts[0]
    return None


def main():
    allowed = read_table()
    problems = []
    for folder, may in allowed.items():
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix not in SUFFIXES or not path.is_file():
                continue
            for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
                match = INCLUDE.match(line)
                if not match:
                    continue
                kind, name = match.groups()
                where = f"{path.relative_to(ROOT)}:{number}"
                target = target_folder(path, name, allowed)
                if target and target != folder and "*" not in may and target not in may:
                    problems.append(f"{where}: {folder} may not include {target} ({name})")
                if folder == "core" and kind == "<" and name not in CORE_HEADERS:
                    problems.append(f"{where}: core may not include <{name}>")
    for problem in problems:
        print(problem)
    if problems:
        sys.exit("check_includes: see the table in docs/architecture.md")


if __name__ == "__main__":
    main()
