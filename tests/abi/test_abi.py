"""The binary interface of the C library: a program that was linked once runs with later ones."""
import os
import pathlib
import shutil
import subprocess

import pytest
from interface import HEADER, ROOT, WRITTEN, functions, library

BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()


def compare(header, folder):
    """abidiff's exit status, 0 for no difference, and what it says."""
    if not WRITTEN.exists():
        pytest.skip(f"there is no {WRITTEN.name}: of this machine's kind nothing is written down")
    if shutil.which("abidiff") is None:
        pytest.skip("abidiff is not installed (tools/setup test)")
    done = subprocess.run(["abidiff", WRITTEN, library(header, folder)], capture_output=True,
                          text=True, timeout=120)
    return done.returncode, done.stdout + done.stderr


def test_programs_linked_with_an_earlier_library_still_run(tmp_path):
    status, said = compare(HEADER.read_text(encoding="utf-8"), tmp_path)
    assert status == 0, f"{said}\nOnly added: run tests/abi/interface.py. Else: a new SOVERSION."


@pytest.mark.parametrize("old,new", [
    ("  float y_m;", "  double y_m;"), ("  uint32_t sender;", "  uint64_t sender;"),
    ("  SWARMTALK_BUSY = 1,", "  SWARMTALK_BUSY = 21,")],
    ids=["a_double_for_a_float", "more_bits", "another_number"])
def test_a_changed_type_is_noticed(tmp_path, old, new):
    header = HEADER.read_text(encoding="utf-8")
    assert old in header, "name what is there"
    status, said = compare(header.replace(old, new), tmp_path)
    assert status & 4, said


def test_the_library_has_each_function_of_the_header():
    built = BUILD / "client_lib/libswarmtalk-c.so.0"
    assert built.exists(), "build the target swarmtalk_c"
    done = subprocess.run(["nm", "--dynamic", "--defined-only", built], capture_output=True,
                          text=True, check=True, timeout=60)
    shown = {line.split()[-1] for line in done.stdout.splitlines()}
    named = functions(HEADER.read_text(encoding="utf-8"))
    assert len(named) > 30
    assert shown - {"SWARMTALK_0"} == {f"{name}@@SWARMTALK_0" for name in named}
    packaged = (ROOT / "debian/libswarmtalk-c0.symbols").read_text(encoding="utf-8")
    assert [name for name in named if f" {name}@SWARMTALK_0 " not in packaged] == []
