"""The Pythons that the client is tested with, and daemons for tests in this process.

SWARMTALK_PYTHONS may name more, as paths with colons between.
"""
import fcntl
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import daemons  # noqa: E402

sys.path.insert(0, daemons.CLIENT)
from scripted_daemon import World  # noqa: E402

ROOT = pathlib.Path(daemons.ROOT)
BUILD = pathlib.Path(daemons.BUILD)
NEWER = [f"python3.{minor}" for minor in range(9, 14)]
# Where a machine has none, it is fetched from a Debian mirror.
PYTHON_2 = pytest.param("python2.7", marks=pytest.mark.field)


def runs(program):
    """Whether it is a Python that can load what the client needs."""
    try:
        return subprocess.run([program, "-c", "import ctypes, select, unittest"], timeout=60,
                              capture_output=True).returncode == 0
    except OSError:
        return False


def debian_11():
    """A python2.7 of Debian 11, unpacked in the build folder and run by its own loader, so that
    neither root nor a change of this machine is needed. Skips where it cannot be had."""
    folder = BUILD / "python2.7"
    program = folder / "python2.7"
    folder.mkdir(exist_ok=True)
    with open(folder / "lock", "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # tests run beside each other
        if not program.exists():
            unpack_debian_11(folder, program)
    return str(program)


def unpack_debian_11(folder, program):
    if shutil.which("mmdebstrap") is None:
        pytest.skip("no python2.7, and mmdebstrap is missing: run tools/setup test")
    shutil.rmtree(folder / "root", ignore_errors=True)
    try:
        done = subprocess.run(
            ["mmdebstrap", "--quiet", "--variant=extract",
             "--include=python2.7-minimal,libpython2.7-stdlib", "bullseye", str(folder / "root")],
            capture_output=True, text=True, timeout=280)
    except subprocess.TimeoutExpired:
        pytest.skip("no python2.7, and Debian 11 did not come from its mirror within 280 s")
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["mmdebstrap failed"])[-1]
        pytest.skip(f"no python2.7, and no Debian 11 to take it from: {last}")
    loader = next((folder / "root/lib").glob("*/ld-2.*.so"))
    libraries = f"{loader.parent}:{folder}/root/usr/lib/{loader.parent.name}"
    program.write_text(
        f"#!/bin/sh\nPYTHONHOME={folder}/root/usr exec {loader} --library-path {libraries} "
        f"{folder}/root/usr/bin/python2.7 \"$@\"\n")
    program.chmod(0o755)


def find_python(name):
    """Path of "python3" (Debian's) or "python2.7". Skips without."""
    if name == "python3":
        return "/usr/bin/python3"
    extra = [path for path in os.environ.get("SWARMTALK_PYTHONS", "").split(":") if path]
    found = [path for path in extra if re.search(r"2\.7|python2", path)]
    found += [path for path in [shutil.which("python2.7")] if path]
    found = [path for path in found if runs(path)]
    return found[0] if found else debian_11()


def newer_pythons():
    """Those of Python 3 that there are beside Debian's; may be none."""
    own = f"python3.{sys.version_info[1]}"
    found = [path for path in os.environ.get("SWARMTALK_PYTHONS", "").split(":")
             if path and "2.7" not in path]
    found += [shutil.which(name) for name in NEWER if name != own and shutil.which(name)]
    return [path for path in found if runs(path)]


@pytest.fixture
def two_robots():
    with daemons.Daemons(2) as robots:
        yield robots


@pytest.fixture(name="world")
def make_world(monkeypatch, tmp_path):
    """A client whose daemon is a script that has not started."""
    world = World(monkeypatch, tmp_path / "s")
    yield world
    world.daemon.stop()
    world.client.close()
