#!/usr/bin/python3
"""tests/abi/interface.py: writes down the binary interface of libswarmtalk-c, as swarmtalk.h has
it, after functions were added. What programs use already must not change: a new SOVERSION
(client_lib/CMakeLists.txt) is the way for that.
"""
import pathlib
import platform
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADER = ROOT / "client_lib/include/swarmtalk/swarmtalk.h"
WRITTEN = pathlib.Path(__file__).with_name(f"libswarmtalk-c.so.0.{platform.machine()}.abi")
FUNCTION = re.compile(r"^SWARMTALK_(?:API|LOOK)[^;{}]*\bswarmtalk_\w+\([^;]*\);", re.M)


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          timeout=60)
    if done.returncode != 0:
        sys.exit(f"{command[0]}: {done.stderr}")


def functions(header):
    """The names of all that a header declares."""
    return sorted(re.search(r"\b(swarmtalk_\w+)\(", each)[1] for each in FUNCTION.findall(header))


def library(header, folder):
    """A library with the interface of that header (text), and nothing in its functions."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "swarmtalk.h").write_text(header, encoding="utf-8")
    bodies = [each[:-1] + " { __builtin_trap(); }" for each in FUNCTION.findall(header)]
    (folder / "library.c").write_text("\n".join(['#include "swarmtalk.h"', *bodies, ""]),
                                      encoding="utf-8")
    result = folder / "libswarmtalk-c.so.0"
    run("gcc", "-shared", "-fPIC", "-g", "-w", folder / "library.c", "-o", result,
        f"-Wl,--version-script={ROOT / 'client_lib/swarmtalk-c.map'}",
        "-Wl,-soname,libswarmtalk-c.so.0")
    return result


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        made = library(HEADER.read_text(encoding="utf-8"), pathlib.Path(name))
        run("abidw", "--no-show-locs", "--no-corpus-path", "--no-comp-dir-path",
            "--out-file", WRITTEN, made)
    print(f"{WRITTEN.relative_to(ROOT)}: say in the commit why it changes")
