"""The whole tree through both compilers of the release, warnings being errors. g++ is given each
source by itself: the usual build joins sources, so a missing include does not show there. clang++
is given them joined, which takes a third of the time. Nothing is linked."""
import concurrent.futures
import json
import os
import pathlib
import shlex
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def configure(folder: pathlib.Path, compiler: str, joins: str) -> list[dict]:
    """The commands that compile the whole tree, whatever it generates being there."""
    c_compiler = {"g++": "gcc", "clang++": "clang"}[compiler]
    subprocess.run(["cmake", "-G", "Ninja", "-S", ROOT, "-B", folder, "-DSWARMTALK_TESTS=ON",
                    "-DSWARMTALK_BENCHMARKS=ON", f"-DSWARMTALK_JOIN_SOURCES={joins}",
                    f"-DCMAKE_CXX_COMPILER={compiler}",
                    f"-DCMAKE_C_COMPILER={c_compiler}"], check=True, capture_output=True)
    made = subprocess.run(["ninja", "-C", folder, "-t", "targets", "rule", "CUSTOM_COMMAND"],
                          check=True, capture_output=True, text=True).stdout.split()
    sources = [name for name in made if name.endswith((".h", ".hpp", ".cc", ".cpp"))]
    subprocess.run(["ninja", "-C", folder, *sources], check=True, capture_output=True)
    return json.loads((folder / "compile_commands.json").read_text())


def complaint(entry: dict) -> str:
    """What the compiler has against a source; nothing if it takes it."""
    words = shlex.split(entry["command"])
    end = words.index("-o")
    done = subprocess.run([*words[:end], *words[end + 2:], "-Werror", "-fsyntax-only"],
                          cwd=entry["directory"], capture_output=True, text=True)
    lines = [line for line in done.stderr.splitlines() if "error" in line]
    return "" if done.returncode == 0 else f"{entry['file']}:\n" + "\n".join(lines[:5])


@pytest.mark.field
@pytest.mark.parametrize("compiler, joins", [("g++", "OFF"), ("clang++", "ON")])
def test_each_source_compiles_without_a_warning(tmp_path, compiler, joins):
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is missing (tools/setup test installs it)")
    entries = configure(tmp_path / "build", compiler, joins)
    assert len(entries) > (300 if joins == "OFF" else 80), "the whole tree"
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as workers:
        found = [text for text in workers.map(complaint, entries) if text]
    print(f"{compiler}: {len(entries)} sources, {len(found)} refused")
    assert not found, "\n".join(found)
