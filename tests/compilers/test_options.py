"""The build's options do what they say."""
import pathlib
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def targets(folder: pathlib.Path, *options: str) -> str:
    """What can be built with these options."""
    subprocess.run(["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", *options], check=True,
                   capture_output=True)
    return subprocess.run(["ninja", "-C", folder, "-t", "targets", "all"], check=True,
                          capture_output=True, text=True).stdout


def test_the_emulator_needs_no_tests(tmp_path):
    if subprocess.run(["pkg-config", "--exists", "simavr"]).returncode != 0:
        pytest.skip("libsimavr-dev is missing: run tools/setup test")
    if shutil.which("ninja") is None:
        pytest.skip("ninja is missing: run tools/setup")
    assert "kilobot-emulator:" in targets(tmp_path, "-DSWARMTALK_EMULATOR=ON")
